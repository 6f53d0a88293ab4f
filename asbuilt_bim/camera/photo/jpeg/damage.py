"""The door of this room: what is damaged in a JPEG, by its coded data and by its decoded picture."""

from asbuilt_bim.camera.photo.jpeg.scan import damage_in_scan, jpeg_frame
from asbuilt_bim.camera.photo.jpeg.seam import seam
from asbuilt_bim.geometry.arrays import ByteImage


def damage_of_data(data: bytes) -> str:
    """Return what is damaged in a file's coded data, "" where nothing is, or where it is no baseline JPEG."""
    frame = jpeg_frame(data)
    return damage_in_scan(data, frame) if frame is not None else ""


def damage_of_picture(data: bytes, image: ByteImage) -> str:
    """Return what its decoded picture shows of damage that the coded data of the same file hides, "" where nothing."""
    frame = jpeg_frame(data)
    if frame is None or (step := seam(image, frame.mcu_px)) is None:
        return ""
    row, column, grey = step
    shade = f"{abs(grey):.0f} grey levels {'lighter' if grey > 0 else 'darker'}"
    return f"all from pixel row {row}, column {column} on is about {shade} or of another colour"
