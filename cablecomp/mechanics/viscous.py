from cablecomp.mechanics.jit import njit
@njit
def viscous_eval(P, I, S, c, end, w, tau, mu):
    return 0.0, 0.0, 0.0
@njit
def viscous_commit(P, I, S, c):
    pass
