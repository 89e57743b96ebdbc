"""Published profiles of the flow in a square cavity under a lid of constant speed.

Tables I and II of U. Ghia, K. N. Ghia and C. T. Shin, J. Comput. Phys. 48 (1982) 387-411, for
Reynolds numbers 100, 400 and 1000: u on the vertical and v on the horizontal centre line, over the
lid's speed. The paper prints the places to four digits; here they are its grid points k / 128.

The tables' own discretisation error shows. Against `solve(reynolds, constant_lid, 56)` of
`lid_driven_cavity.py`, which meets the spectral results of Botella and Peyret (1998) at Re 1000 to
1e-4, the largest deviations but for the misprints are

    Re 100: 0.0050 in u, 0.0093 in v;   Re 400: 0.0028, 0.0062;   Re 1000: 0.0064, 0.0184.

Two entries, kept as printed, are out of line with their neighbours and listed in `MISPRINTS`:

    v at Re 400, x = 0.9063: printed -0.23827, converged -0.38983; off by 0.152, its neighbours
    by 0.006 and 0.004.
    u at Re 100, y = 0.0703: printed -0.04775, converged -0.04663; off by 0.0011, its neighbours
    by 0.0001.

One copy in circulation has v = 0.05188 rather than 0.05186 at Re 400, x = 0.5.
"""

VERTICAL_Y = tuple(
    k / 128 for k in (128, 125, 124, 123, 122, 109, 94, 79, 64, 58, 36, 22, 13, 9, 8, 7, 0)
)
HORIZONTAL_X = tuple(
    k / 128 for k in (128, 124, 123, 122, 121, 116, 110, 103, 64, 30, 29, 20, 12, 10, 9, 8, 0)
)

# u at (0.5, VERTICAL_Y), by Reynolds number.
U = {
    100: (
        *(1.0, 0.84123, 0.78871, 0.73722, 0.68717, 0.23151, 0.00332, -0.13641, -0.20581),
        *(-0.21090, -0.15662, -0.10150, -0.06434, -0.04775, -0.04192, -0.03717, 0.0),
    ),
    400: (
        *(1.0, 0.75837, 0.68439, 0.61756, 0.55892, 0.29093, 0.16256, 0.02135, -0.11477),
        *(-0.17119, -0.32726, -0.24299, -0.14612, -0.10338, -0.09266, -0.08186, 0.0),
    ),
    1000: (
        *(1.0, 0.65928, 0.57492, 0.51117, 0.46604, 0.33304, 0.18719, 0.05702, -0.06080),
        *(-0.10648, -0.27805, -0.38289, -0.29730, -0.22220, -0.20196, -0.18109, 0.0),
    ),
}

# v at (HORIZONTAL_X, 0.5), by Reynolds number.
V = {
    100: (
        *(0.0, -0.05906, -0.07391, -0.08864, -0.10313, -0.16914, -0.22445, -0.24533, 0.05454),
        *(0.17527, 0.17507, 0.16077, 0.12317, 0.10890, 0.10091, 0.09233, 0.0),
    ),
    400: (
        *(0.0, -0.12146, -0.15663, -0.19254, -0.22847, -0.23827, -0.44993, -0.38598, 0.05186),
        *(0.30174, 0.30203, 0.28124, 0.22965, 0.20920, 0.19713, 0.18360, 0.0),
    ),
    1000: (
        *(0.0, -0.21388, -0.27669, -0.33714, -0.39188, -0.51550, -0.42665, -0.31966, 0.02526),
        *(0.32235, 0.33075, 0.37095, 0.32627, 0.30353, 0.29012, 0.27485, 0.0),
    ),
}

# (component, Reynolds number, index in the table) of entries that the docstring tells of.
MISPRINTS = (("v", 400, 5), ("u", 100, 13))
