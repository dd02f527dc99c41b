from setuptools import find_packages, setup

PACKAGE = 'nodlidar_servo'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml', 'LICENSE']),
        (f'share/{PACKAGE}/config', ['config/servo.yaml', 'config/joint_trajectory.yaml']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # so that colcon runs the tests with pytest
    zip_safe=True,
    maintainer='nodlidar maintainers',
    maintainer_email='nodlidar@example.com',
    description='Servo that follows a nod command and publishes joint states.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'servo = nodlidar_servo.ros.node:main',
            'setup = nodlidar_servo.commands.entry_points:setup',
            'joint_trajectory = nodlidar_servo.ros.trajectory_node:main',
        ]
    },
)
