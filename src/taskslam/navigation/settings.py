"""`NavigationSettings`: the one fixed configuration of the navigation stack, the same for every SLAM method.

The defaults are the benchmark's *effective* values (protocol section 3: launch arguments and loading order considered);
numbers that the published files leave out are the defaults of the packages that they configure, named beside each.
Lengths in metres, angles in radians, times in seconds, rates in hertz.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from taskslam.field_types import NonNegative, Positive
from taskslam.task import GoalTolerance

Count = Annotated[int, Field(ge=1)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class CostmapSettings(_Part):
    """Static, obstacle and inflation layer of both costmaps (protocol 3.3)."""

    robot_radius: Positive = 0.20  # common costmap; the inscribed radius of the inflation layer
    inflation_radius: Positive = 0.5  # inflation_layer
    cost_scaling_factor: Positive = 5.0  # inflation_layer
    obstacle_range: Positive = 4.5  # obstacle_layer: farther hits mark nothing
    raytrace_range: Positive = 5.0  # obstacle_layer: rays clear up to here
    clearing_margin_cells: Annotated[int, Field(ge=0)] = 2  # costmap_2d VoxelLayer: clearing ends this short of the hit
    # track_unknown_space false: free cells of the obstacle layer overwrite unknown ones; allow_unknown true
    unknown_is_free: bool = True
    local_size: Positive = 5.0  # local costmap, width and height
    local_resolution: Positive = 0.05  # local costmap
    local_rate: Positive = 5.0  # local costmap update_frequency
    global_rate: Positive = 1.0  # global costmap update_frequency


class GlobalPlannerSettings(_Part):
    """global_planner/GlobalPlanner with its defaults, which are the published values too (protocol 3.4)."""

    rate: Positive = 1.0  # planner_frequency, effective
    neutral_cost: Count = 50
    cost_factor: Positive = 3.0
    lethal_cost: Count = 253


class TebSettings(_Part):
    """Timed elastic band (protocol 3.5; "default" is teb_local_planner's teb_config.h)."""

    dt_ref: Positive = 0.3
    dt_hysteresis: Positive = 0.1
    min_samples: Annotated[int, Field(ge=3)] = 3  # default
    max_samples: Annotated[int, Field(ge=8, le=500)] = 120  # default 500; the horizon never needs more than this
    max_vel_x: Positive = 0.3
    max_vel_x_backwards: Positive = 0.15
    max_vel_theta: Positive = 1.5
    acc_lim_x: Positive = 0.8
    acc_lim_theta: Positive = 1.0
    min_obstacle_dist: Positive = 0.21
    inflation_dist: Positive = 0.6  # default
    costmap_obstacles_behind_robot_dist: NonNegative = 1.0
    obstacle_association_cutoff_factor: Positive = 5.0  # default
    penalty_epsilon: NonNegative = 0.1
    weight_max_vel_x: NonNegative = 2.0
    weight_max_vel_theta: NonNegative = 1.0
    weight_acc_lim_x: NonNegative = 1.0
    weight_acc_lim_theta: NonNegative = 1.0
    weight_kinematics_nh: NonNegative = 1000.0
    weight_kinematics_forward_drive: NonNegative = 1000.0
    weight_optimaltime: NonNegative = 1.0
    weight_obstacle: NonNegative = 500.0
    weight_inflation: NonNegative = 0.1  # default
    weight_adapt_factor: Positive = 2.0  # default; obstacle weight grows by it each outer iteration
    no_inner_iterations: Count = 5
    no_outer_iterations: Count = 4
    # teb_local_planner: the horizon as a share of the local map's half width, 2.125 m
    horizon_factor: Annotated[float, Field(gt=0, le=1)] = 0.85
    moving_average_poses: Count = 3  # teb_local_planner: plan steps that give a local goal its heading
    force_reinit_new_goal_dist: Positive = 1.0  # default
    force_reinit_new_goal_angular: Positive = 1.5707963267948966  # default, pi / 2
    feasibility_check_no_poses: Count = 5
    shrink_horizon_min_duration: NonNegative = 10.0  # default; horizon halved so long after an infeasible band
    max_classes: Count = 4
    roadmap_graph_no_samples: Annotated[int, Field(ge=0)] = 15
    roadmap_graph_area_width: Positive = 6.0
    obstacle_keypoint_offset: Positive = 0.1
    obstacle_heading_threshold: NonNegative = 0.45
    selection_cost_hysteresis: Positive = 0.7
    selection_prefer_initial_plan: Positive = 0.95  # default
    selection_obst_cost_scale: Positive = 100.0  # default
    detours_start_length: Positive = (
        0.4  # default length_start_orientation_vector: candidates that set off backwards go
    )
    max_ratio_detours_duration: Positive = 3.0  # default; slower candidates than this times the fastest are dropped


class GoalSettings(_Part):
    """When a goal is reached (protocol 3.1, 3.5) and when it is given up (3.2; recovery behaviours are off)."""

    xy_tolerance: Positive = GoalTolerance().position_m
    yaw_tolerance: Positive = GoalTolerance().heading_rad
    trans_stopped_velocity: Positive = 0.1  # later releases of teb_local_planner
    theta_stopped_velocity: Positive = 0.1  # later releases of teb_local_planner
    planner_patience: Positive = 5.0
    controller_patience: Positive = 3.0
    oscillation_timeout: Positive = 10.0
    oscillation_distance: Positive = 0.2
    timeout_base: Positive = 60.0  # ours, the published stack waits for ever: base + factor * path length / max_vel_x
    timeout_factor: NonNegative = 3.0  # ours


class NavigationSettings(_Part):
    """Everything that tunes the stack. `controller_rate`: move_base; `smoother_rate`: yocs velocity smoother (3.6)."""

    costmap: CostmapSettings = CostmapSettings()
    global_planner: GlobalPlannerSettings = GlobalPlannerSettings()
    teb: TebSettings = TebSettings()
    goal: GoalSettings = GoalSettings()
    controller_rate: Positive = 5.0
    smoother_rate: Positive = 20.0
