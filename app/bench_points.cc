#include "app/bench_points.h"

#include <pcl/filters/farthest_point_sampling.h>
#include <pcl/point_types.h>

#include "policy/bench_points.h"

namespace flowscope {
namespace {

std::vector<int> choose_by_pcl(const std::vector<Eigen::Vector3f>& position, int count) {
  const auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const Eigen::Vector3f& p : position) cloud->emplace_back(p.x(), p.y(), p.z());
  pcl::FarthestPointSampling<pcl::PointXYZ> sampling;
  sampling.setInputCloud(cloud);
  sampling.setSample(static_cast<std::size_t>(count));
  sampling.setSeed(1);
  pcl::Indices chosen;
  sampling.filter(chosen);
  return {chosen.begin(), chosen.end()};
}

}  // namespace

std::vector<BenchResult> bench_points_against_pcl() {
  const OtherSampler pcl{"PCL", choose_by_pcl};
  return bench_points(&pcl);
}

}  // namespace flowscope
