from setuptools import find_packages, setup

PACKAGE = "motion_execution"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    install_requires=["impact_planner", "robot_driver", "walking"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="Executes hits, walks and passages through a door: the node that moves the robot.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "motion_server = motion_execution.ros.motion_server_node:main",
        ],
    },
)
