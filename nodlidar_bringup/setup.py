from glob import glob

from setuptools import find_packages, setup

PACKAGE = 'nodlidar_bringup'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml', 'LICENSE']),
        (f'share/{PACKAGE}/config', glob('config/*.*')),
        (f'share/{PACKAGE}/config/udev', glob('config/udev/*.rules')),
        (f'share/{PACKAGE}/config/slam', glob('config/slam/*.*')),
        (f'share/{PACKAGE}/config/lidars', glob('config/lidars/*.yaml')),
        (f'share/{PACKAGE}/config/profiles', glob('config/profiles/*.yaml')),
        (f'share/{PACKAGE}/launch', glob('launch/*.py')),
        (f'share/{PACKAGE}/urdf', glob('urdf/*')),
        (f'share/{PACKAGE}/rviz', glob('rviz/*')),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon test knows what runs the tests
    zip_safe=True,
    maintainer='nodlidar maintainers',
    maintainer_email='nodlidar@example.com',
    description='Starts a whole nodding lidar, real or simulated.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'doctor = nodlidar_bringup.commands.entry_points:doctor',
            'install_udev_rules = nodlidar_bringup.commands.entry_points:install_udev_rules',
        ]
    },
)
