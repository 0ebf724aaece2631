from setuptools import find_packages, setup

PACKAGE = "door_impact_view"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    package_data={f"{PACKAGE}.replay": ["web/*"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    install_requires=["hrp2_description", "trimesh", "viser", "yourdfpy"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="Robot and door in a browser: live, and as a replay.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "door_impact_view = door_impact_view.ros.door_impact_view_node:main",
        ],
    },
)
