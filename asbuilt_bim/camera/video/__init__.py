"""A walk recorded as stereo video: its sharp frames, far enough apart, become pairs of photos."""
