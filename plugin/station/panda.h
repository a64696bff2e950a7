// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <drake/geometry/scene_graph.h>
#include <drake/multibody/plant/multibody_plant.h>
#include <drake/systems/framework/diagram_builder.h>
#include <Eigen/Core>

#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/experiment/scene_params.h"
#include "dual_proxy/robots/panda/panda.h"

namespace dual_proxy {

/** @file
The Franka Panda with a wrist force/torque sensor: the simulated arm in its
scene, and the numbers of its model.

Frames: B is panda_link0 (= Drake's world), S the sensor at the flange with the
axes of panda_link7, E the tool point, 0.207 m along +z of panda_link7 with its
axes. */

/** What AddPandaScene() added, and the ports to wire. */
struct PandaScene {
  using InputPort = drake::systems::InputPort<double>;
  using OutputPort = drake::systems::OutputPort<double>;

  /** Finalized, connected, and owned by the diagram. */
  drake::multibody::MultibodyPlant<double>* plant{};
  drake::geometry::SceneGraph<double>* scene_graph{};
  SceneParams params;  ///< What it was built with.
  /** Arm and tool. */
  drake::multibody::ModelInstanceIndex arm;
  /** For ContactTruthSystem. */
  drake::multibody::BodyIndex tool_body;
  /** For SensorReactionSystem. */
  drake::multibody::JointIndex sensor_joint;

  /** Joint torques, 7, N m, clamped by the plant at ArmLimits::torque. */
  const InputPort& get_actuation_input_port() const {
    return plant->get_actuation_input_port(arm);
  }
  /** Joint positions, rad, then velocities, rad/s, 14. */
  const OutputPort& get_state_output_port() const {
    return plant->get_state_output_port(arm);
  }
  /** The reaction at each joint, abstract; see SensorReactionSystem. */
  const OutputPort& get_reaction_forces_output_port() const {
    return plant->get_reaction_forces_output_port();
  }
  /** Abstract ContactResults; see ContactTruthSystem. */
  const OutputPort& get_contact_results_output_port() const {
    return plant->get_contact_results_output_port();
  }
};

/** Adds the simulated Panda, the surfaces of its scene and what its model
directives name to a diagram. If there is a package.xml beside their file, that
folder is a package.

Of arm and tool only what touches carries collision geometry. The plant is
discrete and its output ports are sampled: reaction forces and contact results
are those of the last step (zero and empty before the first).

@param q_start rad: default joint positions of the built diagram.
@param drawn   whether there is anything to see; what is not drawn need not be
               moved along in every step. The physics are the same.
@throws std::invalid_argument if `params` is invalid or `q_start` not finite.
@throws ScenarioError "scene.KEY: ..." if Drake has not what the scene has, if
the model directives cannot be read, or a model touches with an Ellipsoid.
@pre `builder` is not null. */
PandaScene AddPandaScene(drake::systems::DiagramBuilder<double>* builder,
                         const SceneParams& params, const Vector7& q_start,
                         bool drawn);

/** What a controller knows of the Panda: the numbers of its ArmModel, and
inverse kinematics. It may differ from the simulated arm. */
class PandaModel {
 public:
  /** @param tool_mass kg, 1e-3 to 3: of all that is beyond the flange.
  @param gravity   m/s^2, 0 to 100: along -z of B.
  @throws std::invalid_argument naming the one that is out of range. */
  explicit PandaModel(double tool_mass = kToolMass, double gravity = 9.81);

  /** The numbers of arm and tool. */
  const ArmModelParams<7>& arm_params() const { return arm_params_; }

  /** Finds the joint positions that reach a pose, nearest to a posture.
  @param p_BE   m: tool point.
  @param R_BE   its orientation, a rotation matrix.
  @param q_near rad: the posture to stay close to, and the first guess.
  @returns joint positions, rad, within the joint limits.
  @throws std::invalid_argument if no such posture was found, or an argument is
  not what it should be. */
  Vector7 SolveInverseKinematics(
      const Eigen::Vector3d& p_BE,
      const Eigen::Matrix3d& R_BE = kToolPointingDown,
      const Vector7& q_near = kPandaQRest) const;

 private:
  ArmModelParams<7> arm_params_;
};

}  // namespace dual_proxy
