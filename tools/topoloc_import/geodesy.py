# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Earth-centred earth-fixed (ECEF) coordinates in local east, north, up axes, WGS 84."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

SEMI_MAJOR_AXIS_M = 6378137.0
FLATTENING = 1 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2 - FLATTENING)


def latitude_longitude(ecef_m: Array) -> tuple[float, float]:
    """Geodetic latitude and longitude [rad] of a point near the ground."""
    x, y, z = (float(v) for v in ecef_m)
    across = np.hypot(x, y)
    latitude = np.arctan2(z, across * (1 - ECCENTRICITY_SQUARED))
    for _ in range(5):  # each step gains two to three digits
        sine = np.sin(latitude)
        normal = SEMI_MAJOR_AXIS_M / np.sqrt(1 - ECCENTRICITY_SQUARED * sine**2)
        latitude = np.arctan2(z + ECCENTRICITY_SQUARED * normal * sine, across)
    return float(latitude), float(np.arctan2(y, x))


def rotation_enu_ecef(origin_ecef_m: Array) -> Array:
    """Rotation from ECEF axes to east, north, up at a point."""
    latitude, longitude = latitude_longitude(origin_ecef_m)
    sp, cp, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    return np.array([[-sl, cl, 0.0], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]])
