"""Physics concealed in recordings that somebody else made: channels transformed, no model of the drive in between.

What the true drive felt is what was measured. A concealed weight, inertia, friction or neighbour is therefore
taken out of the torque channel, so that the sensor seems not to have seen it, and is exact whatever the drive
is; what acts on the joint's reading (a late clock, a slip, play, a drift) is put on the reading. Imports the
seals of `firmware_sim.trials` and errors alone. Start reading at `physics.py`, then `plan.py`.
"""
