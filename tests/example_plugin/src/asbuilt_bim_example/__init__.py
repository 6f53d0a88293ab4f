"""An example of a package that adds to asbuilt_bim."""
