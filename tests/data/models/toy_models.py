"""Small models that several tests read."""

BOX = "<visual><geometry><box size='{}'/></geometry></visual>"
CABINET = f"""
<robot name="toy cabinet">
  <link name="base">{BOX.format("0.4 0.6 0.8")}</link>
  <link name="frame"/>
  <link name="door">
    <visual><origin xyz="0 0.25 0"/><geometry><box size="0.02 0.5 0.7"/></geometry></visual>
  </link>
  <link name="knob">
    <visual><geometry><sphere radius="0.02"/></geometry></visual>
  </link>
  <link name="tray">{BOX.format("0.3 0.5 0.05")}</link>
  <joint name="lift" type="fixed">
    <origin xyz="0 0 0.1" rpy="0 0 0.3"/><parent link="base"/><child link="frame"/>
  </joint>
  <joint name="hinge" type="revolute">
    <origin xyz="0.2 -0.25 0" rpy="0 0 -0.3"/><parent link="frame"/><child link="door"/>
    <axis xyz="0 0 2"/><limit lower="-0.2" upper="1.5"/>
  </joint>
  <joint name="screw" type="fixed">
    <origin xyz="0.02 0.45 0"/><parent link="door"/><child link="knob"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="frame"/><child link="tray"/>
    <axis xyz="1 0 0"/><limit lower="0.1" upper="0.35"/>
  </joint>
</robot>
"""
