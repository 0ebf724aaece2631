from setuptools import find_packages, setup

PACKAGE = "humanoid_motion"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    install_requires=["hrp2_description", "numpy", "pin", "scipy"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="Kinematics, dynamics, ZMP and clearance of a humanoid, without ROS.",
    license="Apache-2.0",
)
