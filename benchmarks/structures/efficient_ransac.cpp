// Planes and cylinders by efficient RANSAC (Schnabel et al., 2007) of CGAL, with normals by principal components.
// CGAL's Shape_detection is under the GPL: this is for the benchmark only, and no part of the program.
//   efficient_ransac POINTS NEIGHBOURS DISTANCE CLUSTER COSINE LEAST RESULT
// POINTS: float32 x, y, z each; RESULT: int32 shape of each point (0: none). Seconds on stdout.
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <utility>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Random.h>
#include <CGAL/Shape_detection/Efficient_RANSAC.h>
#include <CGAL/pca_estimate_normals.h>
#include <CGAL/property_map.h>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = std::pair<Kernel::Point_3, Kernel::Vector_3>;
using Points = std::vector<Point>;
using PointMap = CGAL::First_of_pair_property_map<Point>;
using NormalMap = CGAL::Second_of_pair_property_map<Point>;
using Traits = CGAL::Shape_detection::Efficient_RANSAC_traits<Kernel, Points, PointMap, NormalMap>;
using Ransac = CGAL::Shape_detection::Efficient_RANSAC<Traits>;

int main(int argc, char** argv) {
  if (argc != 8) return 2;
  CGAL::get_default_random() = CGAL::Random(1);
  Points points;
  std::ifstream in(argv[1], std::ios::binary);
  float p[3];
  while (in.read(reinterpret_cast<char*>(p), sizeof p))
    points.emplace_back(Kernel::Point_3(p[0], p[1], p[2]), Kernel::Vector_3(0.0, 0.0, 0.0));

  const auto start = std::chrono::steady_clock::now();
  CGAL::pca_estimate_normals<CGAL::Sequential_tag>(
      points, std::atoi(argv[2]), CGAL::parameters::point_map(PointMap()).normal_map(NormalMap()));
  const auto middle = std::chrono::steady_clock::now();

  Ransac ransac;
  ransac.set_input(points);
  ransac.add_shape_factory<CGAL::Shape_detection::Plane<Traits>>();
  ransac.add_shape_factory<CGAL::Shape_detection::Cylinder<Traits>>();
  Ransac::Parameters parameters;
  parameters.probability = 0.05;
  parameters.min_points = std::atoi(argv[6]);
  parameters.epsilon = std::atof(argv[3]);
  parameters.cluster_epsilon = std::atof(argv[4]);
  parameters.normal_threshold = std::atof(argv[5]);
  ransac.detect(parameters);
  const auto end = std::chrono::steady_clock::now();

  std::vector<std::int32_t> label(points.size(), 0);
  std::int32_t number = 0;
  for (const auto& shape : ransac.shapes()) {
    ++number;
    for (const auto i : shape->indices_of_assigned_points()) label[i] = number;
  }
  std::ofstream out(argv[7], std::ios::binary);
  out.write(reinterpret_cast<const char*>(label.data()), static_cast<std::streamsize>(label.size() * sizeof(std::int32_t)));
  using Seconds = std::chrono::duration<double>;
  std::cout << Seconds(middle - start).count() << " " << Seconds(end - middle).count() << "\n";
}
