// Region growing of the Point Cloud Library as Ono et al. use it: normals within a radius, curvature and angle thresholds.
//   region_growing POINTS RADIUS CURVATURE DEGREES NEIGHBOURS LEAST RESULT
// POINTS: float32 x, y, z each; RESULT: for each point int32 cluster (0: none) and float32 normal (3). Seconds on stdout.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <limits>
#include <vector>

#include <pcl/features/normal_3d.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/region_growing.h>

int main(int argc, char** argv) {
  if (argc != 8) return 2;
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  std::ifstream in(argv[1], std::ios::binary);
  float p[3];
  while (in.read(reinterpret_cast<char*>(p), sizeof p)) cloud->push_back({p[0], p[1], p[2]});

  const auto start = std::chrono::steady_clock::now();
  pcl::search::Search<pcl::PointXYZ>::Ptr tree(new pcl::search::KdTree<pcl::PointXYZ>);
  pcl::PointCloud<pcl::Normal>::Ptr normals(new pcl::PointCloud<pcl::Normal>);
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setSearchMethod(tree);
  estimation.setInputCloud(cloud);
  estimation.setRadiusSearch(std::atof(argv[2]));
  estimation.compute(*normals);
  const auto middle = std::chrono::steady_clock::now();

  pcl::RegionGrowing<pcl::PointXYZ, pcl::Normal> growing;
  growing.setMinClusterSize(std::atoi(argv[6]));
  growing.setMaxClusterSize(std::numeric_limits<int>::max());
  growing.setSearchMethod(tree);
  growing.setNumberOfNeighbours(std::atoi(argv[5]));
  growing.setInputCloud(cloud);
  growing.setInputNormals(normals);
  growing.setSmoothnessThreshold(std::atof(argv[4]) / 180.0 * M_PI);
  growing.setCurvatureThreshold(std::atof(argv[3]));
  std::vector<pcl::PointIndices> clusters;
  growing.extract(clusters);
  const auto end = std::chrono::steady_clock::now();

  std::vector<std::int32_t> label(cloud->size(), 0);
  for (std::size_t k = 0; k < clusters.size(); ++k)
    for (const auto i : clusters[k].indices) label[i] = static_cast<std::int32_t>(k + 1);
  std::ofstream out(argv[7], std::ios::binary);
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    const float n[3] = {normals->at(i).normal_x, normals->at(i).normal_y, normals->at(i).normal_z};
    out.write(reinterpret_cast<const char*>(&label[i]), sizeof label[i]);
    out.write(reinterpret_cast<const char*>(n), sizeof n);
  }
  using Seconds = std::chrono::duration<double>;
  std::cout << Seconds(middle - start).count() << " " << Seconds(end - middle).count() << "\n";
}
