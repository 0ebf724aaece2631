from glob import glob

from setuptools import find_packages, setup

PACKAGE = "door_model"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    package_data={PACKAGE: ["doors/*", "recordings/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/doors", sorted(glob(f"{PACKAGE}/doors/*"))),
        (f"share/{PACKAGE}/recordings", sorted(glob(f"{PACKAGE}/recordings/*"))),
    ],
    install_requires=["door_impact_common", "mcap", "numpy", "pydantic>=2", "rosbags", "scipy",
                      "zstandard"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="Door-closer linkage, door dynamics, identification of the closer's parameters.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "check_door = door_model.tools.check_door:main",
            "closer_identifier = door_model.ros.closer_identifier_node:main",
            "identify = door_model.tools.identify_cli:main",
        ],
    },
)
