"""Found by pytest from the repository's root too: its folder comes onto the path, and with it `asbuilt_training`."""
