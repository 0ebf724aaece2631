from glob import glob

from setuptools import find_packages, setup

PACKAGE = "hrp2_description"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    package_data={PACKAGE: ["config/*", "urdf/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/config", sorted(glob(f"{PACKAGE}/config/*"))),
        (f"share/{PACKAGE}/urdf", sorted(glob(f"{PACKAGE}/urdf/*"))),
    ],
    install_requires=["door_impact_common", "numpy", "pydantic>=2"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="A model of HRP-2 made from published figures: URDF, frames, soles, limits.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": ["check_robot = hrp2_description.check_robot:main"],
    },
)
