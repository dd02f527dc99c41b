from setuptools import find_packages, setup

PACKAGE = 'sensor_msgs_py'

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
    description='Stand-in for sensor_msgs_py where no ROS 2 is installed: its point_cloud2.',
    license='Apache-2.0',
)
