from setuptools import find_packages, setup

PACKAGE = 'nodlidar_assembler'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml', 'LICENSE']),
        (f'share/{PACKAGE}/config', ['config/assembler.yaml']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon test knows what runs the tests
    zip_safe=True,
    maintainer='nodlidar maintainers',
    maintainer_email='nodlidar@example.com',
    description='Point clouds from a nodding lidar, every beam at its own pose.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'assemble_bag = nodlidar_assembler.commands.entry_points:assemble_bag',
            'assembler = nodlidar_assembler.ros.node:main',
            'calibrate = nodlidar_assembler.commands.entry_points:calibrate',
        ]
    },
)
