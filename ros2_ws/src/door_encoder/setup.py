from setuptools import find_packages, setup

PACKAGE = "door_encoder"

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=find_packages(exclude=["test"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
    ],
    install_requires=["door_model"],
    extras_require={"test": ["pytest", "hypothesis"]},
    zip_safe=False,
    maintainer="hrp2_door_impact maintainers",
    maintainer_email="maintainers@hrp2-door-impact.org",
    description="Door encoder: counts to a checked, unwrapped, zeroed angle.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "door_encoder = door_encoder.ros.door_encoder_node:main",
            "play = door_encoder.ros.play_node:main",
            "counter_board = door_encoder.ros.counter_board_node:main",
        ],
    },
)
