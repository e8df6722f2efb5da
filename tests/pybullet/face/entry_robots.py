"""A robot whose joints tests command by machine code."""

ARM = """<robot name="arm"><link name="base"/>
<link name="a">{inertial}</link><link name="b">{inertial}</link><link name="c">{inertial}</link>
<joint name="one" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="10" velocity="10"/></joint>
<joint name="two" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 0.2"/>
<axis xyz="0 1 0"/></joint>
<joint name="three" type="fixed"><parent link="b"/><child link="c"/><origin xyz="0 0 0.2"/></joint></robot>"""
INERTIAL = """<inertial><origin xyz="0 0 0.1"/><mass value="0.5"/>
<inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.001"/></inertial>"""
