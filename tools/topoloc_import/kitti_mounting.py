# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""How the IMU sits in KITTI's car."""

from topoloc_import.drive_folder import Mounting

KITTI_MOUNTING = Mounting(
    rotation_vehicle_imu_rpy_rad=(0.0, 0.0091, 0.0),
    wheel_reference_imu_m=(0.28, 0.0, 0.0),
    comment="20 KITTI drives pooled (topoloc-calibrate vehicle --oxts *.csv.gz): pitch 0.52,\n"
    "yaw 0.00 degrees, lever arm 0.28 m; 0.2 degrees and 0.16 m spread between drives. Height of\n"
    "the reference point: the IMU's own, where the INS speed of these drives is measured.",
)
