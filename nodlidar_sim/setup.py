from setuptools import find_packages, setup

PACKAGE = 'nodlidar_sim'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={
        PACKAGE: ['py.typed', 'scenes/*.yaml', 'routes/*.yaml', 'servos/*.yaml', 'lidars/*.yaml']
    },
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml', 'LICENSE']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon test knows what runs the tests
    zip_safe=True,
    maintainer='nodlidar maintainers',
    maintainer_email='nodlidar@example.com',
    description='Simulates a nodding lidar, down to the bytes of its two devices.',
    license='Apache-2.0',
    entry_points={'console_scripts': ['emulate = nodlidar_sim.commands.entry_points:emulate']},
)
