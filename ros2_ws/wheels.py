"""Make a virtual environment a ROS 2 Jazzy, from PyPI's wheels, and build the workspace on it.

`python3 ros2_ws/wheels.py check` names what a machine lacks, before anything is installed;
`.venv/bin/python ros2_ws/wheels.py build`, once the requirements are in, does the rest. Where
ROS 2 itself is sourced, nothing of this is needed.
"""

import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

SOURCE = Path(__file__).resolve().parent / "src"
PREFIX = Path(sys.prefix)
BUILT = PREFIX / "ros2_ws"
OLDEST, NEWEST = (3, 11), (3, 14)  # Pythons for which there are wheels of everything
# Packages of messages that PyPI lacks, with the package that they need; `definitions` has those of
# ros2_control, rosbags that of tf2_msgs.
DEFINITIONS = {"tf2_msgs": "geometry_msgs", "control_msgs": "trajectory_msgs"}
PATHS = ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH", "PYTHONPATH")

PACKAGE_XML = """<package format="3">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>Messages of ROS 2 that PyPI lacks</description>
  <maintainer email="info@ros.org">ROS 2</maintainer>
  <license>BSD</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>action_msgs</depend>
  <depend>{depend}</depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""
CMAKE_LISTS = """cmake_minimum_required(VERSION 3.8)
project({name})
find_package(action_msgs REQUIRED)
find_package({depend} REQUIRED)
find_package(rosidl_default_generators REQUIRED)
rosidl_generate_interfaces(${{PROJECT_NAME}} {files} DEPENDENCIES {depend} action_msgs)
ament_package()
"""
ACTIVATION = """# ROS 2 of this environment and its workspace, for bin/activate (ros2_ws/wheels.py).
export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1  # or each Python would start itself anew
# ROS 2's own default would command a robot on the network.
export ROS_AUTOMATIC_DISCOVERY_RANGE="${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}"
"""


def missing() -> list[str]:
    """Return what this machine lacks, one sentence each."""
    lacks = []
    if not OLDEST <= sys.version_info[:2] <= NEWEST:
        lacks.append(f"Python 3.{OLDEST[1]} to 3.{NEWEST[1]}; this is {platform.python_version()}")
    if (sys.platform, platform.machine()) != ("linux", "x86_64"):
        lacks.append(f"Linux on x86_64, where there are wheels of ROS 2; this is {sys.platform} on "
                     f"{platform.machine()}: source ROS 2 Jazzy instead")
    packages = [program for program in ("g++", "cmake") if shutil.which(program) is None]
    if not (Path(sysconfig.get_paths()["include"]) / "Python.h").exists():
        packages.append("python3-dev")
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError:
        packages.append("python3-venv")
    if packages:
        lacks.append(f"{', '.join(packages)}: apt install {' '.join(packages)}")
    return lacks


def repair() -> None:
    """Write this machine's folders of headers into the wheels' CMake files.

    The files name those of the machine on which the wheels were made.
    """
    import numpy

    python, arrays = sysconfig.get_paths()["include"], numpy.get_include()
    for path in PREFIX.glob("share/**/*.cmake"):
        text = path.read_text(encoding="utf-8")
        mended = re.sub(r'/opt/python/[^;"]*?/numpy/_core/include', arrays, text)
        mended = re.sub(r'/opt/python/[^/;"]*/include/python3\.\d+', python, mended)
        if mended != text:
            path.write_text(mended, encoding="utf-8")


def write_definitions() -> None:
    """Write the packages of messages that PyPI lacks."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    for name, depend in DEFINITIONS.items():
        folder = BUILT / "src" / name
        if (known := SOURCE.parent / "definitions" / name).exists():
            shutil.copytree(known, folder, dirs_exist_ok=True)
        else:
            (folder / "msg").mkdir(parents=True, exist_ok=True)
            text, _ = store.generate_msgdef(f"{name}/msg/TFMessage", ros_version=2)
            (folder / "msg" / "TFMessage.msg").write_text(text.split("=" * 20)[0])
        files = " ".join(str(path.relative_to(folder)) for kind in ("msg", "action")
                         for path in sorted(folder.glob(f"{kind}/*")))
        (folder / "package.xml").write_text(PACKAGE_XML.format(name=name, depend=depend))
        (folder / "CMakeLists.txt").write_text(
            CMAKE_LISTS.format(name=name, depend=depend, files=files))


def environment() -> dict[str, str]:
    """Return the variables under which the wheels are found."""
    libraries = [PREFIX / "lib", *sorted(PREFIX.glob("lib/python3*/site-packages/ros_*.libs"))]
    own = {"AMENT_PREFIX_PATH": str(PREFIX), "CMAKE_PREFIX_PATH": str(PREFIX), "PYTHONPATH": "",
           "LD_LIBRARY_PATH": ":".join(map(str, libraries)),
           "PATH": f"{PREFIX / 'bin'}:{os.environ['PATH']}"}
    return {**os.environ, **own}


def build_workspace() -> None:
    """Build the packages as on any ROS 2, by colcon, into the virtual environment."""
    subprocess.run(
        ["colcon", "--log-base", BUILT / "log", "build", "--base-paths", SOURCE, BUILT / "src",
         "--build-base", BUILT / "build", "--install-base", BUILT / "install",
         "--merge-install", "--symlink-install", "--cmake-args", "-DBUILD_TESTING=OFF",
         f"-DPython3_EXECUTABLE={sys.executable}", "--no-warn-unused-cli"],
        check=True, env=environment())


def write_activation() -> None:
    """Let bin/activate set what the workspace's own local_setup.bash sets, without its delay."""
    shown = subprocess.run(
        ["bash", "-c", '. "$0" && env -0', BUILT / "install" / "local_setup.bash"],
        check=True, capture_output=True, text=True, env=environment()).stdout
    found = dict(line.split("=", 1) for line in shown.split("\0") if "=" in line)
    lines = [f"export {name}={shlex.quote(found[name].rstrip(':'))}${{{name}:+:${name}}}\n"
             for name in PATHS]
    (PREFIX / "ros2.sh").write_text(ACTIVATION + "".join(lines))
    activate = PREFIX / "bin" / "activate"
    call = '\n. "$VIRTUAL_ENV/ros2.sh"\n'
    text = activate.read_text(encoding="utf-8")
    if call not in text:
        activate.write_text(text + call, encoding="utf-8")


def main() -> int:
    """Check the machine or build, as the command line says; return 1 if something is missing."""
    if sys.argv[1:] == ["check"]:
        lacks = missing()
        for what in lacks:
            print(f"hrp2_door_impact needs {what}", file=sys.stderr)
        return int(bool(lacks))
    repair()
    write_definitions()
    build_workspace()
    write_activation()
    return 0


if __name__ == "__main__":
    sys.exit(main())
