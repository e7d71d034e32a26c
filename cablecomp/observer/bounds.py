class BoundPair:
    def __init__(self, model): pass
    def start(self, t, m): pass
    def step(self, S): return float("nan"), float("nan")
    def states(self): return []
