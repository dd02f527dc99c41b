from setuptools import find_packages, setup

PACKAGE = 'nodlidar_mapper'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml', 'LICENSE']),
        (f'share/{PACKAGE}/config', ['config/mapper.yaml']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon test knows what runs the tests
    zip_safe=True,
    maintainer='nodlidar maintainers',
    maintainer_email='nodlidar@example.com',
    description='Maps of buildings from the clouds of a nodding lidar and odometry.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'map_bag = nodlidar_mapper.commands.entry_points:map_bag',
            'mapper = nodlidar_mapper.ros.node:main',
        ]
    },
)
