"""What a station costs beside the calls that nobody can avoid, and the memory that a 12-megapixel pair takes.

python benchmarks/site/speed.py --check --json figures.json     all stations of the sample, a 12-megapixel pair
python benchmarks/site/speed.py --quick                         one station, a 12-megapixel pair

Processor seconds of one thread, everything in one process and one run. Unavoidable: decoding both photos, rectifying
both, one pass of semi-global matching at that size, and one pass of a network where one is named. The published
YOLOv8n-seg of the shared data stands in for it; without the data that line is left out.

What a station spends within OpenCV's own functions is reported beside it: with everything else for nothing, it would
still take that much. Most of it is asked for: matching with the photo's left border, occluder-free stereo, markers, the
plumb line from upright edges, and the rig's health from matches of its own.
"""

from __future__ import annotations

import cProfile
import json
import os
import platform
import pstats
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the root of the project

from asbuilt_bim.camera.intrinsics import Intrinsics
from asbuilt_bim.camera.photo.read import Photo, decode, photo_from_bytes, read_photo
from asbuilt_bim.camera.rectify import Rectification, rectification
from asbuilt_bim.camera.rig import StereoRig
from asbuilt_bim.flow.measure_visit import options_of
from asbuilt_bim.flow.rig_source import rig_of
from asbuilt_bim.geometry.arrays import frozen
from asbuilt_bim.measure.station import (
    MeasureOptions,
    Models,
    StationMeasurement,
    StationPhotos,
    measure_station,
)
from asbuilt_bim.project.read import read_project
from asbuilt_bim.scale.cache import Cache, default_folder
from asbuilt_bim.scale.executor import one_thread_each
from asbuilt_bim.vision.networks.kinds import NetworkSegmenter, load
from asbuilt_bim.vision.networks.picture import input_of
from asbuilt_bim.vision.stereo.matching import SIXTEENTHS, SemiGlobalMatcher
from benchmarks.networks.networks import PUBLISHED_CARD
from benchmarks.sites import DATA, SAMPLE
from benchmarks.table import Line, line, options, report, told

MOST_TIMES = 4.5
MOST_MB = 2000.0
LARGE_SCALE = 3.125  # 1280 x 960 to 4000 x 3000
LARGE = "--measure-one-large-pair"


@dataclass(frozen=True, kw_only=True)
class Bench:
    """What every station is measured with."""

    rig: StereoRig
    asked: MeasureOptions
    prepared: Rectification
    network: NetworkSegmenter | None


def seconds(call: Callable[[], object], times: int = 3) -> float:
    """Return the processor seconds of a call, the least of a few: what else runs here only adds."""
    taken = []
    for _ in range(times):
        start = time.process_time()
        call()
        taken.append(time.process_time() - start)
    return min(taken)


def unavoidable(photos: StationPhotos, prepared: Rectification) -> dict[str, float]:
    """Return the seconds of decoding, rectifying and one pass of semi-global matching for one pair."""
    pair = [decode(photos.left), decode(photos.right)]
    maps = [np.array(prepared.left_map), np.array(prepared.right_map)]
    none = np.empty(0, np.float32)

    def carried() -> list[np.ndarray]:
        return [cv2.remap(image, at, none, cv2.INTER_CUBIC) for image, at in zip(pair, maps, strict=True)]

    greys = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in carried()]
    matcher, camera = SemiGlobalMatcher(), prepared.camera
    steps = int(np.ceil(camera.f_px * camera.baseline_m / matcher.nearest_m / SIXTEENTHS) * SIXTEENTHS)
    area = matcher.block_px**2
    engine = cv2.StereoSGBM.create(
        numDisparities=steps, blockSize=matcher.block_px, P1=8 * area, P2=32 * area, disp12MaxDiff=1,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )  # fmt: skip
    coded = [np.frombuffer(photo.data, dtype=np.uint8) for photo in (photos.left, photos.right)]
    return {
        "decode": seconds(lambda: [cv2.imdecode(one, cv2.IMREAD_COLOR) for one in coded]),  # nothing looked for in it
        "rectify": seconds(carried),
        "semi-global matching": seconds(lambda: engine.compute(greys[0], greys[1])),
    }


def seconds_in_opencv(call: Callable[[], object]) -> float:
    """Return the processor seconds that a call spends within OpenCV's own functions."""
    profile = cProfile.Profile(time.process_time)
    profile.runcall(call)
    spent = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    return sum(own for (file, _, name), (_, _, own, _, _) in spent.items() if file == "~" and _is_opencv(name))


def _is_opencv(name: str) -> bool:
    return "cv2." in name or hasattr(cv2, name.strip("<>"))


def published_network() -> NetworkSegmenter | None:
    """Return the published network of the shared data, None where that isn't there."""
    source = DATA / "networks" / "yolov8n-seg_int8.onnx"
    if not source.is_file():
        return None
    with tempfile.TemporaryDirectory(prefix="asbuilt-bim-") as scratch:
        shutil.copyfile(source, Path(scratch) / source.name)
        card = Path(scratch) / "card.yaml"
        card.write_text(PUBLISHED_CARD, encoding="utf-8")
        return NetworkSegmenter(loaded=load(card, "segment"))


@dataclass(kw_only=True)
class Costs:
    """What was found at the stations so far: ratios by what was run, shares of a station by step, seconds."""

    ratios: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    shares: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    seconds: list[float] = field(default_factory=list)
    in_opencv: list[float] = field(default_factory=list)  # over the unavoidable calls

    def add(self, photos: StationPhotos, bench: Bench) -> None:
        """Measure a station with and without a network and hold it against its unavoidable calls."""
        found = measure_station(photos, bench.rig, bench.asked, clock=time.process_time)
        if not isinstance(found, StationMeasurement):
            return
        floor = unavoidable(photos, bench.prepared)
        alone = seconds(lambda: measure_station(photos, bench.rig, bench.asked), 2)
        self.seconds.append(alone)
        self.ratios["without a network"].append(alone / sum(floor.values()))
        opencv = seconds_in_opencv(lambda: measure_station(photos, bench.rig, bench.asked))
        self.in_opencv.append(opencv / sum(floor.values()))
        whole = sum(found.seconds.values())
        for step, value in found.seconds.items():
            self.shares[step].append(value / whole)
        for step, value in floor.items():
            self.shares[f"unavoidable: {step}"].append(value / whole)
        network = bench.network
        if network is not None:
            picture, _ = input_of(decode(photos.left), network.loaded.card.input)
            one_pass = seconds(lambda: network.loaded.network.run((picture,)))
            beside = Models(opinion=network)
            both = seconds(lambda: measure_station(photos, bench.rig, bench.asked, models=beside), 2)
            self.ratios["with the published network"].append(both / (sum(floor.values()) + one_pass))


def station_lines(quick: bool) -> list[Line]:
    """Measure the sample's stations and hold them against the unavoidable calls."""
    project = read_project(SAMPLE / "project.yaml")
    rig = rig_of(project, Cache(folder=default_folder()), lambda *_args, **_more: None).rig
    bench = Bench(rig=rig, asked=options_of(project), prepared=rectification(rig), network=published_network())
    costs = Costs()
    for station in [station for visit in project.visits for station in visit.stations][: 1 if quick else None]:
        photos = StationPhotos(name=station.name, left=read_photo(station.left), right=read_photo(station.right))
        costs.add(photos, bench)
    lines = [
        line(f"a station over its unavoidable calls, {name}", f"{np.median(values):.1f} times", f"<= {MOST_TIMES:g}",
             len(values), bool(np.median(values) <= MOST_TIMES), least_n=1)
        for name, values in costs.ratios.items()
    ]  # fmt: skip
    share = f"{np.median(costs.in_opencv):.1f} times"
    lines.append(told("  OpenCV's own functions in it alone, without a network", share, len(costs.in_opencv)))
    lines.append(told("a station, median processor seconds", f"{np.median(costs.seconds):.2f} s", len(costs.seconds)))
    return lines + [told(f"  {step}", f"{np.mean(part):.0%} of it", len(part)) for step, part in costs.shares.items()]


def large_pair() -> dict[str, float]:
    """Measure one enlarged pair in this process; return its peak memory in MB, its seconds, and its faces."""
    import resource

    project = read_project(SAMPLE / "project.yaml")
    rig = rig_of(project, Cache(folder=default_folder()), lambda *_args, **_more: None).rig
    large = replace(rig, left=_enlarged(rig.left), right=_enlarged(rig.right), covariance=frozen(np.zeros((14, 14))))
    station = project.visits[0].stations[1]
    left, right = _enlarged_photo(station.left, large.left), _enlarged_photo(station.right, large.right)
    photos = StationPhotos(name=station.name, left=left, right=right)
    start = time.process_time()
    found = measure_station(photos, large, MeasureOptions(target=options_of(project).target))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024.0 if sys.platform != "darwin" else 1024.0**2)
    faces = len(found.faces) if isinstance(found, StationMeasurement) else 0
    return {"peak_mb": peak, "seconds": time.process_time() - start, "faces": float(faces)}


def _enlarged(camera: Intrinsics) -> Intrinsics:
    k = np.array(camera.K)
    k[:2, :2] *= LARGE_SCALE
    k[:2, 2] = (k[:2, 2] + 0.5) * LARGE_SCALE - 0.5
    size = round(camera.width_px * LARGE_SCALE), round(camera.height_px * LARGE_SCALE)
    return replace(camera, K=frozen(k), width_px=size[0], height_px=size[1])


def _enlarged_photo(path: Path, camera: Intrinsics) -> Photo:
    """Enlarge a photo and give it a sensor's noise, so that it isn't smoother than a real one."""
    image = decode(read_photo(path))
    image = cv2.resize(image, (camera.width_px, camera.height_px), interpolation=cv2.INTER_CUBIC)
    noise = np.zeros(image.shape, np.int8)
    cv2.randn(noise, 0, 2)
    grainy = cv2.add(image, noise, dtype=cv2.CV_8U)
    return photo_from_bytes(path.name, cv2.imencode(".jpg", grainy, [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes())


def memory_lines() -> list[Line]:
    """Measure a 12-megapixel pair in a process of its own."""
    try:
        import resource  # noqa: F401
    except ImportError:  # Windows
        return [told("12 megapixels, peak memory", "not known on this system", 0)]
    done = subprocess.run([sys.executable, __file__, LARGE], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"the large pair could not be measured:\n{done.stderr}")
    found = json.loads(done.stdout.splitlines()[-1])
    mb, faces = found["peak_mb"], int(found["faces"])
    return [
        line("12 megapixels, peak memory of the process", f"{mb:.0f} MB", f"< {MOST_MB:.0f} MB", 1,
             mb < MOST_MB and faces > 0, least_n=1),
        told("  its processor seconds", f"{found['seconds']:.1f} s", 1),
        told("  its faces", str(faces), 1),
    ]  # fmt: skip


def again_on_one_thread() -> None:
    """Start this program anew where the arithmetic libraries have loaded with threads: their waiting is counted, too.

    On a machine that does something else a sum of 40,000 numbers took a thousand times as long.
    """
    if os.environ.get("OPENBLAS_NUM_THREADS") is None:
        one_thread_each()
        raise SystemExit(subprocess.run([sys.executable, *sys.argv], check=False).returncode)


def main() -> int:
    """Print the table."""
    again_on_one_thread()
    cv2.setNumThreads(1)
    if LARGE in sys.argv:
        print(json.dumps(large_pair()))
        return 0
    args = options(__doc__ or "").parse_args()
    machine = {"processor": _processor(), "processors": os.cpu_count(), "threads": cv2.getNumThreads()}
    lines = [*station_lines(args.quick), *memory_lines()]
    return report("What a station costs", lines, args, {"machine": machine})


def _processor() -> str:
    """Return what the system calls its processor: seconds mean little without it."""
    try:
        names = [one for one in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines() if "model name" in one]
    except OSError:
        names = []
    return names[0].partition(":")[2].strip() if names else platform.processor() or platform.machine()


if __name__ == "__main__":
    sys.exit(main())
