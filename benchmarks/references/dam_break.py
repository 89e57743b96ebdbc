"""Published experiments of a column of water that collapses.

`FRONT_TIME`, `FRONT`: table 2 of J. C. Martin and W. J. Moyce, Phil. Trans. R. Soc. A 244 (1952)
312-324, for a column twice as high as its width a = 2 1/4 in: the front x / a at t (2 g / a)^1/2.

`SENSOR_TIME`, `SENSOR_PRESSURE`: B. Buchner, Green Water on Ship-type Offshore Structures, PhD
thesis, Delft (2002): p / (rho g H) at t (g / H)^1/2 on the wall opposite to a column 2 H wide and
H = 0.6 m high, in a tank of 5.366 H. The sensor is a disc of 0.15 H across, 0.2 H above the floor
as numerical work takes it (Greco 2001, Marrone et al. 2011). Read off the published curve, two
readings of which agree to 0.02. It is kept up to 5.2: then the plunging jet closes over a pocket of
air, which a fluid without air does not have.
"""

FRONT_TIME = (
    *(0.41, 0.84, 1.19, 1.43, 1.63, 1.83, 1.98, 2.20, 2.32, 2.51),
    *(2.65, 2.83, 2.98, 3.11, 3.33),
)
FRONT = (1.11, 1.22, 1.44, 1.67, 1.89, 2.11, 2.33, 2.56, 2.78, 3.00, 3.22, 3.44, 3.67, 3.89, 4.11)

SENSOR_TANK = (161.0 / 30.0, 3.0)  # H
SENSOR_HEIGHT = 0.2  # H
SENSOR_TIME = (
    *(2.25, 2.43, 2.47, 2.49, 2.55, 2.62, 2.65, 2.69, 2.77, 2.90, 3.02, 3.13, 3.23, 3.37),
    *(3.52, 3.68, 3.90, 4.06, 4.22, 4.36, 4.57, 4.72, 4.92, 5.04, 5.16),
)
SENSOR_PRESSURE = (
    *(0.00, 0.00, 0.08, 0.15, 0.27, 0.42, 0.56, 0.66, 0.69, 0.66, 0.63, 0.58, 0.55, 0.54),
    *(0.54, 0.54, 0.54, 0.56, 0.56, 0.55, 0.54, 0.54, 0.51, 0.51, 0.51),
)
