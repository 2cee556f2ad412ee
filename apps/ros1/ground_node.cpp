// A ROS 1 node: a scan in, its ground and its obstacles out.
//   subscribes  points (sensor_msgs/PointCloud2)
//   publishes   ground, obstacles: the points of the scan with all their fields, under its own header
//   ~preset     parameters, as `btms params` lists them; single-scan
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>

#include <chrono>
#include <cstdio>

#include "apps/ros1/scan_labeller.h"
#include "robotics/point_cloud2.h"

namespace {

class GroundNode {
 public:
  GroundNode()
      : labeller_(ros::param::param<std::string>("~preset", "single-scan")),
        ground_(node_.advertise<sensor_msgs::PointCloud2>("ground", 10)),
        obstacles_(node_.advertise<sensor_msgs::PointCloud2>("obstacles", 10)),
        points_(node_.subscribe("points", 10, &GroundNode::take, this)) {}

  void report() const {
    if (scans_ == 0) return;
    // Not by ROS_INFO, which says nothing any more when the node ends.
    std::printf("%zu scans, %.2f ms each: %.0f scans/s, %.1f million points/s\n", scans_, 1e3 * seconds_ / scans_,
                scans_ / seconds_, 1e-6 * points_seen_ / seconds_);
    std::fflush(stdout);
  }

 private:
  void take(const sensor_msgs::PointCloud2ConstPtr& scan) try {
    const auto begin = std::chrono::steady_clock::now();
    const btms::CloudView cloud = btms::view_of(*scan);
    const std::vector<std::uint8_t>& labels = labeller_.labels_of(btms::columns_of(cloud, scratch_));
    sensor_msgs::PointCloud2Ptr ground = like(*scan), obstacles = like(*scan);
    btms::split(cloud, labels.data(), labels.size(), ground->data, obstacles->data);
    publish(ground_, ground);
    publish(obstacles_, obstacles);
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    points_seen_ += static_cast<double>(cloud.points());
    if (++scans_ % 100 == 0) report();
  } catch (const std::exception& error) {
    ROS_ERROR_THROTTLE(5, "a scan is left out: %s", error.what());
  }

  static sensor_msgs::PointCloud2Ptr like(const sensor_msgs::PointCloud2& scan) {
    sensor_msgs::PointCloud2Ptr cloud(new sensor_msgs::PointCloud2);
    cloud->header = scan.header;
    cloud->fields = scan.fields;
    cloud->is_bigendian = scan.is_bigendian;
    cloud->is_dense = scan.is_dense;
    cloud->point_step = scan.point_step;
    cloud->height = 1;
    return cloud;
  }
  static void publish(const ros::Publisher& to, const sensor_msgs::PointCloud2Ptr& cloud) {
    cloud->row_step = static_cast<std::uint32_t>(cloud->data.size());
    cloud->width = cloud->row_step / cloud->point_step;
    to.publish(cloud);
  }

  ros::NodeHandle node_;
  btms::ScanLabeller labeller_;
  std::vector<float> scratch_;
  ros::Publisher ground_, obstacles_;
  ros::Subscriber points_;
  std::size_t scans_ = 0;
  double seconds_ = 0, points_seen_ = 0;
};

}  // namespace

int main(int argc, char** argv) try {
  ros::init(argc, argv, "btms_ground");
  const GroundNode node;
  ros::spin();
  node.report();
} catch (const std::exception& error) {
  ROS_FATAL("%s", error.what());
  return 1;
}
