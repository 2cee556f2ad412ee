"""The ROS 1 node on a bag: ros1_node.py BTMS NODE. rosbag plays scans of a synthetic drive, rosbag records what the node
publishes; that must be what `btms segment` says of the same scans."""
import os, signal, socket, subprocess, sys, tempfile, time
from pathlib import Path

try:
    import numpy as np
    import rosbag, rospy
    from sensor_msgs.msg import PointCloud2, PointField
except ImportError as missing:
    print(missing, "(cmake/install-deps.sh --ros1)")
    sys.exit(77)

btms, node = sys.argv[1:]
SCANS = 20


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def message(points, n):
    cloud = PointCloud2(height=1, width=len(points), point_step=16, row_step=16 * len(points), is_dense=True, data=points.tobytes())
    cloud.header.frame_id = "velodyne"
    cloud.header.stamp = rospy.Time(100 + n // 10, n % 10 * 100000000)
    cloud.fields = [PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate(["x", "y", "z", "intensity"])]
    return cloud


def records(cloud):
    assert cloud.width * cloud.point_step == len(cloud.data) and cloud.header.frame_id == "velodyne"
    return np.frombuffer(cloud.data, "<f4").reshape(-1, 4)


def main(folder):
    subprocess.check_call([btms, "synth", "--drive", "--scans", str(SCANS), "--beams", "32", "--azimuths", "512", "--points", "300000",
                           "-o", folder / "drive", "--quiet"], stdout=subprocess.DEVNULL)
    files = sorted((folder / "drive").glob("**/*.bin"))
    assert len(files) == SCANS
    subprocess.check_call([btms, "segment", *files, "--preset", "single-scan", "-o", folder / "labels", "--quiet"], stdout=subprocess.DEVNULL)
    scans = [np.fromfile(f, "<f4").reshape(-1, 4) for f in files]
    with rosbag.Bag(str(folder / "in.bag"), "w") as bag:
        for n, scan in enumerate(scans):
            cloud = message(scan, n)
            bag.write("/points", cloud, cloud.header.stamp)

    port = free_port()
    env = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_HOME=str(folder / "ros"))
    started = []

    def start(*words, **more):
        started.append(subprocess.Popen([str(w) for w in words], env=env, **more))
        return started[-1]

    def stop(process):
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        return process.wait(20)

    try:
        start("rosmaster", "--core", "-p", port, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        until = time.time() + 30
        while socket.socket().connect_ex(("127.0.0.1", port)) != 0:
            assert time.time() < until, "no ROS master"
            time.sleep(0.1)
        said = open(folder / "said", "w")
        ground = start(node, stdout=said, stderr=subprocess.STDOUT)
        record = start("rosbag", "record", "-O", folder / "out.bag", "/ground", "/obstacles", stdout=subprocess.DEVNULL)
        time.sleep(2)
        play = start("rosbag", "play", "--quiet", "--wait-for-subscribers", "-d", "1", folder / "in.bag", stdin=subprocess.DEVNULL)
        assert play.wait(60) == 0
        time.sleep(1)
        stop(record)
        assert stop(ground) == 0
    finally:
        for process in started:
            if process.poll() is None:
                process.kill()
                process.wait()

    clouds = {"/ground": {}, "/obstacles": {}}
    with rosbag.Bag(str(folder / "out.bag")) as bag:
        for topic, cloud, _ in bag.read_messages():
            clouds[topic][cloud.header.stamp.to_nsec()] = records(cloud)
    # ROS drops what a busy machine can't keep up with; what arrives must be right.
    rows = lambda points: points.copy().view("V16").ravel().tolist()  # whole records
    compared = 0
    for n, scan in enumerate(scans):
        stamp = message(scan, n).header.stamp.to_nsec()
        if not all(stamp in topic for topic in clouds.values()):
            continue
        labels = np.fromfile(next((folder / "labels").glob(f"**/{files[n].stem}.label")), "<u4") & 0xFFFF
        assert np.array_equal(clouds["/ground"][stamp], scan[labels == 40]), n
        obstacles, others = rows(clouds["/obstacles"][stamp]), rows(scan[labels == 99])  # and those below the ground
        assert 0.98 * len(others) <= len(obstacles) <= len(others) and set(obstacles) <= set(others), n
        compared += 1
    assert compared >= SCANS // 4, compared
    rate = [line for line in open(folder / "said") if "scans/s" in line]
    assert rate
    print(f"{compared} scans compared; {rate[-1].strip()}")


with tempfile.TemporaryDirectory(prefix="btms-ros1-") as folder:
    main(Path(folder))
