from glob import glob

from setuptools import find_packages, setup

PACKAGE = "door_impact_bringup"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", sorted(glob("launch/*"))),
        (f"share/{PACKAGE}/config", sorted(glob("config/*"))),
        (f"share/{PACKAGE}/rviz", sorted(glob("rviz/*"))),
        (f"share/{PACKAGE}/foxglove", sorted(glob("foxglove/*"))),
    ],
    install_requires=["door_model", "zmp_publisher"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="Launch files, parameters, scene and recorder of hrp2_door_impact.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "recorder = door_impact_bringup.recorder_node:main",
            "up = door_impact_bringup.up:main",
            "scene_publisher = door_impact_bringup.scene_publisher_node:main",
        ],
    },
)
