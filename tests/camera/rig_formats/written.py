"""A rig as other programs and makers write it: texts made from one rig, so that what is read can be held against it."""

from __future__ import annotations

import json

import numpy as np

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.geometry.arrays import FloatArray
from asbuilt_bim.geometry.transform import inverse, rigid, vector_from_rotation

EYES = ("LEFT", "RIGHT")


def pinhole(camera: Intrinsics) -> tuple[float, float, float, float]:
    return camera.K[0, 0], camera.K[1, 1], camera.K[0, 2], camera.K[1, 2]


def zed_conf(rig: StereoRig, size: str = "HD") -> str:
    """An SN*.conf, of a rig whose photos have a ZED's size: millimetres, and the right eye's pose negative."""
    lines = ["; a comment"]
    for eye, camera in zip(EYES, (rig.left, rig.right), strict=True):
        fx, fy, cx, cy = map(float, pinhole(camera))
        k1, k2, p1, p2, k3 = camera.distortion.tolist()
        lines += [f"[{eye}_CAM_{size}]", f"fx={fx!r}", f"fy = {fy!r}", f"cx={cx!r}", f"cy={cy!r}"]
        lines += [f"k1={k1!r}", f"k2={k2!r}", f"k3={k3!r}", f"p1={p1!r}", f"p2={p2!r}", ""]
    x, y, z = (float(part) for part in -1000.0 * rig.right_from_left[:3, 3])
    rx, ry, rz = (float(part) for part in vector_from_rotation(rig.right_from_left[:3, :3]))
    lines += ["[STEREO]", f"BaseLine={x!r}", f"TY={y!r}", f"TZ={z!r}"]
    lines += [f"CV_{size}={ry!r}", f"RX_{size}={rx!r}", f"RZ_{size}={rz!r}"]
    return "\n".join(lines) + "\n"


def zed_listing(rig: StereoRig, name: str = "ZED") -> str:
    lines = ["%% a listing", "%{", "ZED.FHD.L.fx = wrong", "%}"]
    for eye, camera in zip("LR", (rig.left, rig.right), strict=True):
        numbers = dict(zip(("fx", "fy", "cx", "cy"), pinhole(camera), strict=True))
        numbers |= dict(zip(("k1", "k2", "p1", "p2", "k3"), camera.distortion, strict=True))
        lines += [f"{name}.HD.{eye}.{key} = {float(value)!r};  % px" for key, value in numbers.items()]
    x, y, z = (float(part) for part in -1000.0 * rig.right_from_left[:3, 3])
    rx, ry, rz = (float(part) for part in vector_from_rotation(rig.right_from_left[:3, :3]))
    lines += [f"{name}.E.Baseline = {x!r};", f"{name}.E.TY = {y!r};", f"{name}.E.TZ = {z!r};"]
    lines += [f"{name}.E.HD.RX = {rx!r};", f"{name}.E.HD.RY = {ry!r};", f"{name}.E.HD.RZ = {rz!r};"]
    return "\n".join(lines) + "\n"


def oak_eeprom(rig: StereoRig, *, by_middle: bool = False) -> str:
    """depthai's dump; `by_middle`: left and right are both known by the middle camera alone, as on some boards."""
    middle_from_left = rigid([0.01, -0.02, 0.005], [-0.1, 0.002, 0.001])
    middle_from_right = middle_from_left @ inverse(rig.right_from_left)
    nowhere = np.zeros((4, 4))
    poses = {1: (rig.right_from_left, 2), 2: (middle_from_right, 0), 0: (nowhere, -1)}
    if by_middle:
        poses[1] = (middle_from_left, 0)
    data = [
        [socket, _socket(camera, poses[socket][0], poses[socket][1])]
        for socket, camera in ((0, rig.left), (1, rig.left), (2, rig.right))
    ]
    stereo = {"leftCameraSocket": 1, "rightCameraSocket": 2}
    return json.dumps({"boardName": "", "cameraData": data, "stereoRectificationData": stereo, "version": 6})


def _socket(camera: Intrinsics, pose: FloatArray, to: int) -> dict[str, object]:
    x, y, z = (100.0 * pose[:3, 3]).tolist()
    return {
        "cameraType": 1 if camera.lens == "fisheye" else 0,
        "distortionCoeff": [*camera.distortion.tolist(), *[0.0] * (14 - len(camera.distortion))],
        "extrinsics": {
            "rotationMatrix": pose[:3, :3].tolist(),
            "translation": {"x": x, "y": y, "z": z},
            "toCameraSocket": to,
        },
        "intrinsicMatrix": camera.K.tolist(),
        "width": camera.width_px,
        "height": camera.height_px,
    }


def oak_small(rig: StereoRig) -> str:
    def lens(camera: Intrinsics) -> list[float]:
        return [*camera.distortion.tolist(), *[0.0] * (14 - len(camera.distortion))]

    return json.dumps(
        {
            "width": rig.left.width_px,
            "height": rig.left.height_px,
            "left_intrinsics": rig.left.K.tolist(),
            "right_intrinsics": rig.right.K.tolist(),
            "rotation_left_to_right": rig.right_from_left[:3, :3].tolist(),
            "translation_left_to_right": (100.0 * rig.right_from_left[:3, 3:]).tolist(),
            "distortion_left": lens(rig.left),
            "distortion_right": lens(rig.right),
        }
    )


def realsense_listing(rig: StereoRig) -> str:
    lines = ["Device info:", "    Name : Intel RealSense", ""]
    for number, camera in ((1, rig.left), (2, rig.right)):
        fx, fy, cx, cy = pinhole(camera)
        lens = "\t".join(repr(float(one)) for one in camera.distortion)
        size = f"{camera.width_px}x{camera.height_px}"
        lines += [f'Intrinsic of "Infrared {number}" / {size} / {{Y8}}', f"  Width:      \t{camera.width_px}"]
        lines += [f"  PPX:        \t{float(cx)!r}", f"  PPY:        \t{float(cy)!r}", f"  Fx:         \t{float(fx)!r}"]
        lines += [f"  Fy:         \t{float(fy)!r}", "  Distortion: \tBrown Conrady", f"  Coeffs:     \t{lens}", ""]
    rows = ["   " + "   ".join(repr(float(one)) for one in row) for row in rig.right_from_left[:3, :3]]
    shift = "  ".join(repr(float(one)) for one in rig.right_from_left[:3, 3])
    lines += ['Extrinsic from "Infrared 1"\t  To\t  "Infrared 2" :', " Rotation Matrix:", *rows]
    lines += [
        "",
        f" Translation Vector: {shift}",
        "",
        'Extrinsic from "Infrared 2" To "Infrared 1" :',
        " Rotation Matrix:",
    ]
    return "\n".join(lines) + "\n"


def basalt_json(rig: StereoRig) -> str:
    body_from_left = rigid([0.3, -1.2, 0.4], [0.02, -0.07, 0.01])
    poses = [body_from_left, body_from_left @ inverse(rig.right_from_left)]
    lenses = []
    for camera in (rig.left, rig.right):
        numbers = dict(zip(("fx", "fy", "cx", "cy"), map(float, pinhole(camera)), strict=True))
        numbers |= dict(zip(("k1", "k2", "k3", "k4"), map(float, camera.distortion), strict=True))
        lenses.append({"camera_type": "kb4", "intrinsics": numbers})
    sizes = [[camera.width_px, camera.height_px] for camera in (rig.left, rig.right)]
    return json.dumps(
        {"value0": {"T_imu_cam": [_with_quaternion(pose) for pose in poses], "intrinsics": lenses, "resolution": sizes}}
    )


def _with_quaternion(pose: FloatArray) -> dict[str, float]:
    vector = vector_from_rotation(pose[:3, :3])
    angle = float(np.linalg.norm(vector))
    x, y, z = np.sin(0.5 * angle) * vector / angle
    names = ("px", "py", "pz", "qx", "qy", "qz", "qw")
    return dict(zip(names, map(float, [*pose[:3, 3], x, y, z, np.cos(0.5 * angle)]), strict=True))


def matlab_json(rig: StereoRig) -> str:
    """jsonencode(toStruct(stereoParams)): transposed matrices, pixels from 1, millimetres."""
    document: dict[str, object] = {"WorldUnits": "millimeters"}
    for number, camera in ((1, rig.left), (2, rig.right)):
        K = camera.K.copy()
        K[:2, 2] += 1.0
        k1, k2, p1, p2, k3 = camera.distortion.tolist()
        document[f"CameraParameters{number}"] = {
            "RadialDistortion": [k1, k2, k3],
            "TangentialDistortion": [p1, p2],
            "ImageSize": [camera.height_px, camera.width_px],
            "IntrinsicMatrix": K.T.tolist(),
        }
    document["RotationOfCamera2"] = rig.right_from_left[:3, :3].T.tolist()
    document["TranslationOfCamera2"] = (1000.0 * rig.right_from_left[:3, 3]).tolist()
    return json.dumps(document)


def bouguet_m(rig: StereoRig) -> str:
    def row(values: FloatArray) -> str:
        return "[ " + " ; ".join(repr(float(one)) for one in values) + " ]"

    lines = [f"om = {row(vector_from_rotation(rig.right_from_left[:3, :3]))};"]
    lines += [
        f"T = {row(rig.right_from_left[:3, 3])}; % metres",
        f"nx = {rig.left.width_px};",
        f"ny = {rig.left.height_px};",
    ]
    for side, camera in (("left", rig.left), ("right", rig.right)):
        fx, fy, cx, cy = pinhole(camera)
        lines += [f"fc_{side} = {row(np.array([fx, fy]))};", f"cc_{side} = {row(np.array([cx, cy]))};"]
        lines += [f"kc_{side} = {row(camera.distortion)};"]
    return "\n".join(lines) + "\n"


def metashape_xml(rig: StereoRig, pairs: int = 2, moved_m: float = 0.0) -> str:
    """Exported cameras: two sensors, aligned as one rig, half a metre a unit; `moved_m` moves the last right one."""
    scale = 0.5
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<document version="2.0.0">', "<chunk>", "<sensors>"]
    for number, camera in enumerate((rig.left, rig.right)):
        fx, fy, cx, cy = pinhole(camera)
        k1, k2, p1, p2, k3 = camera.distortion.tolist()
        size = f'<resolution width="{camera.width_px}" height="{camera.height_px}"/>'
        middle = float(cx - 0.5 * camera.width_px + 0.5), float(cy - 0.5 * camera.height_px + 0.5)
        lines += [f'<sensor id="{number}" label="eye" type="frame">', size, f'<calibration type="frame">{size}']
        lines += [f"<f>{float(fy)!r}</f><cx>{middle[0]!r}</cx><cy>{middle[1]!r}</cy><b1>{float(fx - fy)!r}</b1>"]
        lines += [f"<k1>{k1!r}</k1><k2>{k2!r}</k2><k3>{k3!r}</k3><p1>{p2!r}</p1><p2>{p1!r}</p2>"]
        lines += ["</calibration>", "</sensor>"]
    lines += ["</sensors>", f"<transform><scale>{scale!r}</scale></transform>", "<cameras>"]
    for pair in range(pairs):
        world_from_left = rigid([0.1 * pair, 0.2, -0.1], [pair, 2.0, 0.5])
        right_from_left = rig.right_from_left.copy()
        right_from_left[0, 3] -= moved_m if pair == pairs - 1 else 0.0
        right_from_left[:3, 3] /= scale
        for number, pose in enumerate((world_from_left, world_from_left @ inverse(right_from_left))):
            master = f' master_id="{2 * pair}"' if number else ""
            text = " ".join(repr(float(one)) for one in pose.ravel())
            lines += [f'<camera id="{2 * pair + number}" sensor_id="{number}"{master} label="p">']
            lines += [f"<transform>{text}</transform>", "</camera>"]
    return "\n".join([*lines, "</cameras>", "</chunk>", "</document>"]) + "\n"


def vins_files(rig: StereoRig) -> dict[str, str]:
    """VINS: a configuration with both poses in the body's frame, which names a file of each camera."""
    body_from_left = rigid([0.3, -1.2, 0.4], [0.02, -0.07, 0.01])
    lines = ["%YAML:1.0", "num_of_cam: 2", 'cam0_calib: "left.yaml"', 'cam1_calib: "right.yaml"']
    for number, pose in enumerate((body_from_left, body_from_left @ inverse(rig.right_from_left))):
        data = ", ".join(repr(float(one)) for one in pose.ravel())
        lines += [
            f"body_T_cam{number}: !!opencv-matrix",
            "   rows: 4",
            "   cols: 4",
            "   dt: d",
            f"   data: [ {data} ]",
        ]
    files = {"config.yaml": "\n".join(lines) + "\n"}
    for name, camera in (("left", rig.left), ("right", rig.right)):
        fx, fy, cx, cy = (float(one) for one in pinhole(camera))
        text = ["%YAML:1.0", "---", f"image_width: {camera.width_px}", f"image_height: {camera.height_px}"]
        if camera.lens == "fisheye":
            k2, k3, k4, k5 = camera.distortion.tolist()
            text += ["model_type: KANNALA_BRANDT", "projection_parameters:", f"   k2: {k2!r}", f"   k3: {k3!r}"]
            text += [
                f"   k4: {k4!r}",
                f"   k5: {k5!r}",
                f"   mu: {fx!r}",
                f"   mv: {fy!r}",
                f"   u0: {cx!r}",
                f"   v0: {cy!r}",
            ]
        else:
            k1, k2, p1, p2 = camera.distortion[:4].tolist()
            text += [
                "model_type: PINHOLE",
                "distortion_parameters:",
                f"   k1: {k1!r}",
                f"   k2: {k2!r}",
                f"   p1: {p1!r}",
            ]
            text += [f"   p2: {p2!r}", "projection_parameters:", f"   fx: {fx!r}", f"   fy: {fy!r}", f"   cx: {cx!r}"]
            text += [f"   cy: {cy!r}"]
        files[f"{name}.yaml"] = "\n".join(text) + "\n"
    return files
