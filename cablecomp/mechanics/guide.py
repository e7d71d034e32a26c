from cablecomp.mechanics.jit import njit
@njit
def guide_split(P, I, S, J, L, c, tension, x_in, w_in, e_out, a_out):
    return 0.0, 0.0
@njit
def guide_commit(P, I, S, J, c):
    pass
