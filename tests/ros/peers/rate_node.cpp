// A node as many are: a worker thread that sleeps in simulated time, a queue of scans, and the base from /tf.
// It answers every scan with where odometry has the base at its stamp, once the clock has reached it. ~fault spoils it.
#include <csignal>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <string>
#include <thread>

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/LaserScan.h>
#include <std_srvs/Empty.h>
#include <tf2_msgs/TFMessage.h>

namespace {
std::mutex lock;
std::deque<sensor_msgs::LaserScan> scans;
std::deque<geometry_msgs::TransformStamped> odometry;
int late_transforms = 0, late_clock = 0, resets = 0;

void takeScan(const sensor_msgs::LaserScan& scan) {
  std::lock_guard<std::mutex> hold(lock);
  scans.push_back(scan);
}

void takeTransforms(const tf2_msgs::TFMessage& message) {
  std::lock_guard<std::mutex> hold(lock);
  for (const auto& transform : message.transforms)
    if (transform.child_frame_id == "base_link") odometry.push_back(transform);
}

bool reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  ++resets;
  return true;
}

const geometry_msgs::TransformStamped* at(const ros::Time& stamp) {
  for (const auto& transform : odometry)
    if (transform.header.stamp == stamp) return &transform;
  return nullptr;
}
}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "rate_node");
  ros::NodeHandle node, own("~");
  std::string fault, topic = "/pose";
  int after = 3, whole = 0;
  double rate = 100.0;
  bool late = false;
  own.getParam("fault", fault);
  own.getParam("after", after);
  own.getParam("rate", rate);
  own.getParam("whole", whole);
  own.getParam("topic", topic);
  own.getParam("late", late);
  own.setParam("heard", 0);
  ros::Publisher pose;
  const auto offer = [&] { pose = node.advertise<geometry_msgs::PoseWithCovarianceStamped>(topic, 10); };
  if (!late) offer();
  auto scan = node.subscribe("/scan", 100, takeScan);
  auto tf = node.subscribe("/tf", 100, takeTransforms);
  auto service = node.advertiseService("/reset", reset);
  ros::AsyncSpinner spinner(2);
  spinner.start();
  std::printf("whole %d rate %g\n", whole, rate);
  std::fflush(stdout);
  int answered = 0;
  ros::Rate pace(rate);
  while (ros::ok()) {
    {
      std::lock_guard<std::mutex> hold(lock);
      while (!scans.empty()) {
        const auto& header = scans.front().header;
        if (ros::Time::now() < header.stamp) { ++late_clock; break; }
        const auto* base = at(header.stamp);
        if (base == nullptr) { ++late_transforms; break; }
        geometry_msgs::PoseWithCovarianceStamped answer;
        answer.header = header;
        answer.header.frame_id = "map";
        answer.pose.pose.position.x = base->transform.translation.x;
        answer.pose.pose.position.y = base->transform.translation.y;
        answer.pose.pose.orientation = base->transform.rotation;
        scans.pop_front();
        if (++answered <= after) {
          if (fault == "begins_late") continue;
        } else {
          if (fault == "dies") { std::fprintf(stderr, "the map has no cells\n"); std::abort(); }
          if (fault == "hangs") std::raise(SIGSTOP);
          if (fault == "silent") continue;
          if (fault == "wrong_frame") answer.header.frame_id = "world";
          if (fault == "nan") answer.pose.pose.position.x = std::nan("");
          if (fault == "back") answer.header.stamp -= ros::Duration(0.05);
          if (fault == "ahead") answer.header.stamp += ros::Duration(0.05);
          if (fault == "warns") ROS_WARN("the frame base_linc does not exist");
          if (fault == "works")  // 20 ms of processor time
            for (auto until = std::clock() + CLOCKS_PER_SEC / 50; std::clock() < until;) {}
        }
        if (!pose) { offer(); continue; }
        pose.publish(answer);
      }
    }
    pace.sleep();
  }
  std::printf("resets %d\n", resets);
}
