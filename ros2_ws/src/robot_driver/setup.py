from setuptools import find_packages, setup

PACKAGE = "robot_driver"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    install_requires=["humanoid_motion"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="The topics of a robot's driver: messages, their checks, and the watch over them.",
    license="Apache-2.0",
)
