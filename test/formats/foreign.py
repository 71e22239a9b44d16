# SPDX-License-Identifier: MIT
"""Other programs read our files, and we read theirs.

usage: foreign.py numpy|open3d|cloudcompare FOREIGN DIR

FOREIGN is the program of foreign.cpp, DIR a folder to work in. Exits with 77 (skipped) if the other
program is not installed.
"""
import os
import shutil
import subprocess
import sys

SKIPPED = 77


def skip(why):
    print("skipped:", why)
    sys.exit(SKIPPED)


try:
    import numpy as np
except ImportError:
    skip("NumPy is not installed (Debian: python3-numpy)")


def expected(folder, k):
    """Name of each column -> its numbers, of example scan k."""
    path = os.path.join(folder, f"{k}.txt")
    with open(path) as file:
        names = file.readline().split()
    return dict(zip(names, np.loadtxt(path, skiprows=1).T))


def points(columns):
    return np.stack([columns[axis] for axis in "xyz"], axis=1)


def same(found, wanted, tolerance, what):
    found = np.asarray(found, float)
    assert found.shape == wanted.shape, f"{what}: shape {found.shape}, expected {wanted.shape}"
    error = np.abs(found - wanted).max()
    assert error <= tolerance, f"{what}: off by {error}"
    print(f"{what}: {len(found)} points or values, off by {error:.2g}")


def read_by_us(foreign, path):
    text = subprocess.run([foreign, "read", path], check=True, capture_output=True, text=True).stdout
    return np.array([line.split() for line in text.splitlines()], float)


def check_numpy(foreign, folder):
    print("NumPy", np.__version__)
    for k in range(2):
        columns = expected(folder, k)
        array = np.load(f"{folder}/npy/{k:04}.npy")
        names = np.loadtxt(f"{folder}/npy/columns.txt", dtype=str)
        assert list(names) == list(columns), names
        same(array, np.stack(list(columns.values()), axis=1), 0, "npy")
        # The devkit of KITTI reads its scans like this.
        scan = np.fromfile(f"{folder}/kitti/velodyne/{k:06}.bin", np.float32).reshape(-1, 4)
        same(scan[:, :3], points(columns), 0, "kitti")
        same(scan[:, 3], columns["intensity"], 0, "kitti reflectance")
        # LAS by the tables of its specification, independently of our code.
        with open(f"{folder}/las/{k:04}.las", "rb") as file:
            data = file.read()
        scale, offset = np.frombuffer(data, "<f8", 6, 131).reshape(2, 3)
        record = np.dtype([("xyz", "<i4", 3), ("intensity", "<u2"), ("returns", "u1"),
                           ("class", "u1"), ("angle", "i1"), ("user", "u1"), ("source", "<u2"),
                           ("time", "<f8")])
        las = np.frombuffer(data, record, int.from_bytes(data[107:111], "little"),
                            int.from_bytes(data[96:100], "little"))
        same(las["xyz"] * scale + offset, points(columns), 0.5e-5 + 1e-13, "las")
        same(las["time"], columns["time"], 0, "las time")
        same(las["returns"] & 7, columns["echo"], 0, "las return")
        same(np.loadtxt(f"{folder}/uos/scan{k:03}.3d")[:, [2, 0, 1]] * [0.01, -0.01, 0.01],
             points(columns), 0.5e-6 + 1e-13, "uos")
    wanted = points(expected(folder, 0))
    same(np.load(f"{folder}/cloud.npy"), wanted, 0, ".npy")
    same(np.loadtxt(f"{folder}/cloud.csv", delimiter=",", skiprows=1), wanted, 0, ".csv")
    # And NumPy's files read by us.
    wide = np.concatenate([wanted, wanted], axis=1)
    path = f"{folder}/numpy.npy"
    for type_name in ("<f4", "<f8", ">f4", ">f8"):
        for array in (wanted, wide, np.asfortranarray(wanted), np.asfortranarray(wide)):
            for version in ((1, 0), (2, 0), (3, 0)):
                with open(path, "wb") as file:
                    np.lib.format.write_array(file, array.astype(type_name, order="K"), version)
                same(read_by_us(foreign, path), wanted, 0, f"NumPy's {type_name} {version}")
    np.savetxt(f"{folder}/numpy.csv", wanted, delimiter=",", header="x,y,z")
    same(read_by_us(foreign, f"{folder}/numpy.csv"), wanted, 0, "NumPy's .csv")


def check_open3d(foreign, folder):
    try:
        import open3d
    except ImportError:
        skip("Open3D is not installed (Debian: python3-open3d)")
    print("Open3D", open3d.__version__)
    for k in range(2):
        wanted = points(expected(folder, k))
        order = np.lexsort(wanted.T)
        for path in (f"scans/{k:04}.ply", f"pcd/{k:04}.pcd"):
            cloud = open3d.io.read_point_cloud(f"{folder}/{path}", remove_nan_points=True)
            found = np.asarray(cloud.points)
            same(found[np.lexsort(found.T)], wanted[order], 0, path)
    wanted = points(expected(folder, 0))
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(wanted))
    for name, options in (("a.ply", {}), ("b.ply", {"write_ascii": True}), ("c.pcd", {}),
                          ("d.pcd", {"write_ascii": True}), ("e.pcd", {"compressed": True}),
                          ("f.xyz", {})):
        path = f"{folder}/{name}"
        assert open3d.io.write_point_cloud(path, cloud, **options)
        # Text has six digits or more; coordinates are below 100.
        same(read_by_us(foreign, path), wanted, 0.5e-4, f"Open3D's {name} {options}")


def check_cloudcompare(foreign, folder):
    program = shutil.which("CloudCompare")
    if program is None:
        skip("CloudCompare is not installed (Debian: cloudcompare)")
    environment = dict(os.environ, QT_QPA_PLATFORM="offscreen")
    wanted = points(expected(folder, 0))
    for name in ("scans/0000.ply", "cloud.ply", "cloud.csv", "cloud.xyz"):
        out = f"{folder}/cloudcompare.asc"
        subprocess.run([program, "-SILENT", "-AUTO_SAVE", "OFF", "-C_EXPORT_FMT", "ASC", "-PREC", "9",
                        "-O", f"{folder}/{name}", "-SAVE_CLOUDS", "FILE", out],
                       check=True, env=environment, capture_output=True, timeout=120)
        # CloudCompare holds single precision; coordinates are below 128.
        same(np.loadtxt(out, comments="//")[:, :3], wanted, 128 * 2.0**-24, name)


def main():
    check, foreign, folder = sys.argv[1:]
    subprocess.run([foreign, "write", folder], check=True)
    {"numpy": check_numpy, "open3d": check_open3d, "cloudcompare": check_cloudcompare}[check](
        foreign, folder)


main()
