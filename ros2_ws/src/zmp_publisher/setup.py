from setuptools import find_packages, setup

PACKAGE = "zmp_publisher"

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
    description="ZMP, CoM and support polygon from foot wrenches and joint angles.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "zmp_publisher = zmp_publisher.zmp_publisher_node:main",
        ],
    },
)
