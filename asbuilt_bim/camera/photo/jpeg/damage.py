"""The door of this room: a JPEG's pixels, and what is damaged by its coded data, its decoder and its picture."""

from asbuilt_bim.camera.photo.jpeg.decode import decoded_jpeg
from asbuilt_bim.camera.photo.jpeg.scan import damage_in_scan, jpeg_frame
from asbuilt_bim.camera.photo.jpeg.seam import seam
from asbuilt_bim.geometry.arrays import ByteImage


def sound_jpeg(data: bytes) -> tuple[ByteImage | None, str]:
    """Return the pixels (H, W, 3) BGR of a JPEG, None where there are none, and what its coded data lacks.

    What only the picture shows is told by `damage_of_picture`.
    """
    frame = jpeg_frame(data)
    if frame is not None and (damage := damage_in_scan(data, frame)):
        return None, damage
    return decoded_jpeg(data, counted=frame is not None and bool(frame.blocks))


def damage_of_picture(data: bytes, image: ByteImage) -> str:
    """Return what its decoded picture shows of damage that the coded data of the same file hides, "" where nothing."""
    frame = jpeg_frame(data)
    if frame is None or (step := seam(image, frame.mcu_px)) is None:
        return ""
    row, column, grey = step
    shade = f"{abs(grey):.0f} grey levels {'lighter' if grey > 0 else 'darker'}"
    return f"all from pixel row {row}, column {column} on is about {shade} or of another colour"
