from setuptools import find_packages, setup

PACKAGE = "hrp2_sim_bridge"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    install_requires=["door_model", "humanoid_motion", "mujoco", "pydantic>=2", "robot_driver"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="A simulated robot in front of a door, in place of the robot's driver.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "hrp2_sim_bridge = hrp2_sim_bridge.ros.hrp2_sim_bridge_node:main",
        ],
    },
)
