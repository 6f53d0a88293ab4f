from __future__ import annotations

from datetime import date
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asbuilt_bim.camera.photo.exif import exif_from_tiff
from asbuilt_bim.camera.photo.picture_file import look_at
from asbuilt_bim.camera.photo.read import decode, photo_from_bytes, read_photo, side_by_side
from asbuilt_bim.errors import PhotoError
from tests.camera.virtual import exif_block, with_exif


def picture(width: int = 64, height: int = 48) -> np.ndarray:
    return np.random.default_rng(3).integers(0, 255, (height, width, 3), dtype=np.uint8)


def encoded(kind: str = ".jpg", **size: int) -> bytes:
    return cv2.imencode(kind, picture(**size))[1].tobytes()


def test_a_photo_is_read_with_its_size_digest_and_camera(tmp_path: Path) -> None:
    file = tmp_path / "a.jpg"
    file.write_bytes(with_exif(encoded(), exif_block(focal_mm=8.5)))
    photo = read_photo(file)
    assert (photo.exif.model, photo.exif.serial, photo.exif.focal_length_mm) == ("Maker One", "L-1", 8.5)
    assert (photo.exif.width_px, photo.exif.height_px, photo.exif.orientation) == (64, 48, 1)
    assert len(photo.digest) == 64
    assert decode(photo).shape == (48, 64, 3)


@pytest.mark.parametrize(("opacity", "hidden"), [(0, "100%"), (1.0, ""), ("half", "50%")])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_a_picture_with_transparent_pixels_is_no_photo_and_an_opaque_one_is(
    opacity: float | str, hidden: str, kind: type
) -> None:
    alpha = np.zeros((48, 64, 1)) if opacity == 0 else np.ones((48, 64, 1))
    alpha[:24] *= 0.0 if opacity == "half" else 1.0
    most = np.iinfo(kind).max
    colours = picture().astype(kind) * (most // 255)
    data = cv2.imencode(".png", np.concatenate([colours, (alpha * most).astype(kind)], axis=2))[1].tobytes()
    photo = photo_from_bytes("a.png", data)
    if not hidden:
        assert decode(photo).shape == (48, 64, 3)
        return
    with pytest.raises(PhotoError, match=f"photo a.png: {hidden} of its pixels are transparent"):
        decode(photo)


def test_a_png_is_decoded_as_it_was_stored() -> None:
    assert np.array_equal(decode(photo_from_bytes("a.png", encoded(".png"))), picture())


def test_twelve_bits_stored_in_sixteen_are_refused_as_nearly_black_and_a_dim_photo_isnt() -> None:
    values = np.random.default_rng(3).integers(0, 4096, (60, 80, 3)).astype(np.uint16)
    dark, dim = (photo_from_bytes("deep.png", cv2.imencode(".png", values * k)[1].tobytes()) for k in (1, 4))
    with pytest.raises(PhotoError, match=r"deep.png: it is nearly black, 0.00% .* export it over the whole range"):
        decode(dark)
    assert decode(dim).max() == 63


def test_exif_orientation_does_not_turn_the_pixels() -> None:
    turned = photo_from_bytes("a.jpg", with_exif(encoded(), exif_block(orientation=6)))
    assert turned.exif.orientation == 6
    assert decode(turned).shape == (48, 64, 3)


@pytest.mark.parametrize(
    ("name", "data", "says"),
    [
        ("empty.jpg", b"", "empty"),
        ("notes.jpg", b"These are my notes of the visit.\n", "looks like text"),
        ("phone.heic", b"\x00\x00\x00\x18ftypheic" + b"\x00" * 32, r"looks like HEIC\)"),
        ("walk.mov", b"\x00\x00\x00\x14ftypqt  " + b"\x00" * 32, "a video, which belongs under video"),
        ("walk.mkv", b"\x1aE\xdf\xa3" + b"\x00" * 32, "a video, which belongs under video"),
        ("raw.jpg", b"II*\x00" + b"\x00" * 32, "RAW"),
        ("cut.jpg", encoded()[: len(encoded()) // 2], "truncated"),
        ("end.jpg", encoded()[:-2], "truncated"),
        ("cut.png", encoded(".png")[:-12], "truncated"),
    ],
)
def test_what_is_no_whole_picture_is_refused_by_name_with_a_remedy(name: str, data: bytes, says: str) -> None:
    with pytest.raises(PhotoError, match=says) as raised:
        photo_from_bytes(name, data)
    assert name in str(raised.value) and "again" in str(raised.value)


def test_a_missing_photo_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PhotoError, match=r"nothing\.jpg: there is no such file"):
        read_photo(tmp_path / "nothing.jpg")
    with pytest.raises(PhotoError, match=r"folder|can't be read"):
        read_photo(tmp_path)


def test_a_picture_of_too_many_pixels_is_refused_before_it_is_decoded() -> None:
    data = bytearray(encoded(".png"))
    data[16:24] = (40_000).to_bytes(4, "big") * 2
    with pytest.raises(PhotoError, match="40000 x 40000 pixels exceed 100 million"):
        photo_from_bytes("bomb.png", bytes(data))


def test_damage_inside_that_leaves_a_grey_bottom_is_refused() -> None:
    jpeg = encoded(width=256, height=256)
    scan = jpeg.index(b"\xff\xda") + 14
    cut = jpeg[: scan + (len(jpeg) - scan) // 3].rstrip(b"\xff") + b"\xff\xd9"
    with pytest.raises(PhotoError, match=r"grey|damaged"):
        decode(photo_from_bytes("hole.jpg", cut))


def test_a_path_with_umlauts_spaces_and_250_characters_works(tmp_path: Path) -> None:
    folder = tmp_path / "Baustelle Süd – Prüfung"
    folder.mkdir()
    file = folder / ("Stütze ä " + "x" * (250 - len(str(folder)) - 14) + ".jpg")
    file.write_bytes(encoded())
    assert decode(read_photo(file)).shape == (48, 64, 3)


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=200))
def test_hostile_exif_never_fails(tail: bytes) -> None:
    for header in (b"II*\x00\x08\x00\x00\x00", b"MM\x00*\x00\x00\x00\x08", b""):
        exif = exif_from_tiff(header + tail, 10, 10)
        assert exif.width_px == 10


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 20_000), st.binary(min_size=1, max_size=8))
def test_a_damaged_file_is_refused_or_decoded_never_a_crash(place: int, junk: bytes) -> None:
    data = with_exif(encoded(), exif_block())
    place %= len(data)
    damaged = data[:place] + junk + data[place + len(junk) :]
    assert look_at(damaged).problem or look_at(damaged).width_px
    try:
        decode(photo_from_bytes("x.jpg", damaged))
    except PhotoError as error:
        assert "x.jpg" in str(error)


@pytest.mark.parametrize(
    ("taken", "day"),
    [("2026:03:02 09:33:00", date(2026, 3, 2)), ("0000:00:00 00:00:00", None), ("yesterday", None), ("", None)],
)
def test_the_day_is_the_cameras_clocks_and_unknown_where_it_says_none_or_nonsense(taken: str, day: date | None) -> None:
    assert photo_from_bytes("a.jpg", with_exif(encoded(), exif_block(taken=taken))).exif.taken == day


def test_a_png_that_ends_within_its_first_chunk_is_refused() -> None:
    for count in range(8, 32):
        data = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + bytes(40)
        with pytest.raises(PhotoError, match=r"a\.png: "):
            photo_from_bytes("a.png", data[:count])


def test_a_file_of_both_eyes_is_two_photos_each_half_as_wide() -> None:
    both = photo_from_bytes("both.png", encoded(".png"))
    left, right = side_by_side(both)
    assert left.size_px == right.size_px == (32, 48) and len({left.digest, right.digest, both.digest}) == 3
    assert np.array_equal(np.concatenate([decode(left), decode(right)], axis=1), picture())
    with pytest.raises(PhotoError, match="63 pixels wide, so it can't hold two photos"):
        side_by_side(photo_from_bytes("odd.png", encoded(".png", width=63)))
