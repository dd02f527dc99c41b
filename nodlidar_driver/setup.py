from setuptools import find_packages, setup

PACKAGE = 'nodlidar_driver'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml', 'LICENSE']),
        (f'share/{PACKAGE}/config', ['config/driver.yaml', 'config/ldrobot.yaml']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # so that colcon runs the tests with pytest
    zip_safe=True,
    maintainer='nodlidar maintainers',
    maintainer_email='nodlidar@example.com',
    description='Drivers of Hokuyo lidars (SCIP 2.0) and of the LD06 and LD19: to LaserScan.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'driver = nodlidar_driver.ros.scip_node:main',
            'ldrobot = nodlidar_driver.ros.ldrobot_node:main',
            'probe = nodlidar_driver.commands.entry_points:probe',
        ]
    },
)
