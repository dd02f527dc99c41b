"""The command `plan_scan`, which chooses the nod that finds an object soonest."""

from nodlidar_common.command_line import command

main = command('plan_scan', 'nodlidar_planner.plan_scan.planning:plan_scan')
