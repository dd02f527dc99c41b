from setuptools import find_packages, setup

PACKAGE = 'ros2cli'

setup(
    name=PACKAGE,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={PACKAGE: ['py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='nodlidar maintainers',
    maintainer_email='nodlidar@example.com',
    description='The ros2 command, with the commands that nodlidar calls.',
    license='Apache-2.0',
    entry_points={'console_scripts': ['ros2 = ros2cli.cli:main']},
)
