"""From photos of boards to a calibrated stereo rig, and from a rig to rectified pairs."""
