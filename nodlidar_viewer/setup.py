from setuptools import find_packages, setup

PACKAGE = 'nodlidar_viewer'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml', 'LICENSE']),
        (f'share/{PACKAGE}/config', ['config/viewer.yaml']),
    ],
    install_requires=['setuptools'],
    extras_require={'test': ['pytest']},  # by which colcon test knows what runs the tests
    zip_safe=True,
    maintainer='nodlidar maintainers',
    maintainer_email='nodlidar@example.com',
    description='The sensor seen live in a browser.',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'view_bag = nodlidar_viewer.commands.entry_points:view_bag',
            'viewer = nodlidar_viewer.ros.main:main',
        ]
    },
)
