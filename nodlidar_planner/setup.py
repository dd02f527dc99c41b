from setuptools import find_packages, setup

PACKAGE = 'nodlidar_planner'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml', 'LICENSE']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon test knows what runs the tests
    zip_safe=True,
    maintainer='nodlidar maintainers',
    maintainer_email='nodlidar@example.com',
    description='Scan pattern and coverage of a nodding lidar, and the choice of its nod.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': ['plan_scan = nodlidar_planner.commands.entry_points:plan_scan']
    },
)
