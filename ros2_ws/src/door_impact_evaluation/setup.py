from setuptools import find_packages, setup

PACKAGE = "door_impact_evaluation"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    install_requires=[
        "dask", "distributed", "door_encoder", "door_impact_bringup", "door_impact_view",
        "hrp2_sim_bridge", "impact_planner", "matplotlib", "Pillow", "pyarrow", "tqdm", "walking"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="Demonstration, benchmarks, sweeps, studies and report of hrp2_door_impact.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "bench = door_impact_evaluation.bench.bench:main",
            "demo = door_impact_evaluation.demo.demo:main",
            "demo_runner = door_impact_evaluation.demo.demo_runner_node:main",
            "physics_study = door_impact_evaluation.studies.physics_study:main",
            "report = door_impact_evaluation.report.command:main",
            "sweep = door_impact_evaluation.sweep.sweep:main",
        ],
    },
)
