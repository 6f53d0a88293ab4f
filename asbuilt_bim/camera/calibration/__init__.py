"""Photos of boards, or surveyed points, become a calibrated stereo rig."""
