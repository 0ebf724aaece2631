from setuptools import find_packages, setup

PACKAGE = "impact_planner"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    install_requires=["door_model", "humanoid_motion", "matplotlib", "pydantic>=2"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="Planning of a whole-body impact that opens a heavy swing door.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "impact_planner = impact_planner.ros.impact_planner_node:main",
            "plan = impact_planner.tools.plan_cli:main",
            "find_posture = impact_planner.tools.posture_cli:main",
        ],
    },
)
