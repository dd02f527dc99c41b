from setuptools import find_packages, setup

PACKAGE = 'nodlidar_demo'

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
    description='Records, measures and shows a nodding lidar in a simulated scene.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'demo = nodlidar_demo.commands.entry_points:demo',
            'demo_mapping = nodlidar_demo.commands.entry_points:demo_mapping',
        ]
    },
)
