"""The two models that nearly every world includes and that ship with Gazebo itself: `sun` and `ground_plane`.

Used where no resource path has them.
"""

STOCK_MODELS = {
    "sun": """<sdf version="1.6"><light type="directional" name="sun">
      <pose>0 0 10 0 0 0</pose><diffuse>0.8 0.8 0.8 1</diffuse><specular>0.2 0.2 0.2 1</specular>
      <attenuation><range>1000</range><constant>0.9</constant><linear>0.01</linear><quadratic>0.001</quadratic></attenuation>
      <direction>-0.5 0.1 -0.9</direction></light></sdf>""",
    "ground_plane": """<sdf version="1.6"><model name="ground_plane"><static>true</static><link name="link">
      <collision name="collision"><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>
      </collision>
      <visual name="visual"><geometry><plane><normal>0 0 1</normal><size>100 100</size></plane></geometry>
      <material><script><name>Gazebo/Grey</name></script></material></visual></link></model></sdf>""",
}
