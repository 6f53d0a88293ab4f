"""AprilTag and ArUco markers, and their corners."""
