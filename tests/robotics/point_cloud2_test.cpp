// Clouds as ROS sends them, without ROS.
#include "robotics/point_cloud2.h"

#include <gtest/gtest.h>

#include <random>

#include "engine/tiling/scan_segmenter.h"

namespace btms {
namespace {

// As generated message types have it.
struct Message {
  struct Field {
    std::string name;
    std::uint32_t offset;
    std::uint8_t datatype;
    std::uint32_t count;
  };
  std::uint32_t height = 0, width = 0;
  std::vector<Field> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;
  std::vector<std::uint8_t> data;
};

struct Shape {
  std::uint32_t height = 1, padding = 0;
  bool doubles = false, big = false;
};

// A floor with a wall on it; a byte before the fields, and the point's number behind them.
Message cloud_of(const Shape& shape) {
  const std::uint32_t number = shape.doubles ? 8 : 4, points = 6000;
  Message m;
  m.height = shape.height;
  m.width = points / shape.height;
  m.is_bigendian = shape.big;
  m.point_step = 1 + 3 * number + 4;
  m.row_step = m.width * m.point_step + shape.padding;
  const auto type = static_cast<std::uint8_t>(shape.doubles ? 8 : 7);
  m.fields = {{"z", 1 + 2 * number, type, 1}, {"x", 1, type, 1}, {"y", 1 + number, type, 1}};
  m.data.resize(std::size_t{m.row_step} * m.height);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-20, 20), noise(-0.02f, 0.02f), up(0.5f, 2);
  for (std::uint32_t i = 0; i < points; ++i) {
    const bool wall = i % 5 == 0;
    const float xyz[] = {wall ? 8 + noise(random) : place(random), place(random), wall ? up(random) : noise(random)};
    std::uint8_t* at = m.data.data() + i / m.width * m.row_step + i % m.width * m.point_step;
    for (int k = 0; k < 3; ++k) {
      std::uint8_t bytes[8];
      const double wide = xyz[k];
      std::memcpy(bytes, shape.doubles ? static_cast<const void*>(&wide) : &xyz[k], number);
      for (std::uint32_t b = 0; b < number; ++b) at[1 + k * number + b] = bytes[shape.big ? number - 1 - b : b];
    }
    std::memcpy(at + 1 + 3 * number, &i, 4);
  }
  return m;
}

std::vector<Label> labels_of(const Message& m, std::vector<float>& scratch) {
  const Columns xyz = columns_of(view_of(m), scratch);
  ScanSegmenter segmenter(preset("single-scan"));
  const auto labels = segmenter.segment({xyz.x_m, xyz.y_m, xyz.z_m, xyz.size, xyz.stride_bytes});
  return {labels.begin(), labels.end()};
}

TEST(PointCloud2, WhatDriversSendIsNotCopied) {
  const Message m = cloud_of({});
  std::vector<float> scratch;
  const Columns xyz = columns_of(view_of(m), scratch);
  EXPECT_TRUE(scratch.empty());
  EXPECT_EQ(static_cast<const void*>(xyz.z_m), m.data.data() + 9);
  EXPECT_EQ(xyz.stride_bytes, m.point_step);
}

TEST(PointCloud2, EveryFormOfACloudHasTheSameLabels) {
  std::vector<float> scratch;
  const std::vector<Label> expected = labels_of(cloud_of({}), scratch);
  EXPECT_EQ(std::count(expected.begin(), expected.end(), Label::kObstacle), 1200);
  for (const Shape& shape : {Shape{4, 0, false, false},
                             {4, 12, false, false},
                             {1, 0, true, false},
                             {1, 0, false, true},
                             {60, 5, true, true}}) {
    scratch.clear();
    EXPECT_EQ(labels_of(cloud_of(shape), scratch), expected);
    EXPECT_EQ(scratch.empty(), shape.padding == 0 && !shape.doubles && !shape.big);
  }
}

TEST(PointCloud2, TheTwoCloudsHaveTheWholeRecordsInOrder) {
  const Message m = cloud_of({4, 12, false, false});
  std::vector<float> scratch;
  std::vector<Label> labels = labels_of(m, scratch);
  labels[17] = Label::kDropped;
  labels[18] = Label::kBelow;
  std::vector<std::uint8_t> ground, obstacles;
  split(view_of(m), labels.data(), labels.size(), ground, obstacles);
  EXPECT_EQ(ground.size() + obstacles.size(), (6000u - 2) * m.point_step);
  std::vector<std::uint32_t> expected[2], found[2];
  for (std::uint32_t i = 0; i < 6000; ++i)
    if (labels[i] == Label::kTerrain || labels[i] == Label::kObstacle)
      expected[labels[i] == Label::kObstacle].push_back(i);
  for (int k = 0; k < 2; ++k)
    for (std::size_t at = 0; at < (k ? obstacles : ground).size(); at += m.point_step)
      found[k].push_back(detail::number_at<std::uint32_t>((k ? obstacles : ground).data() + at + 13, false));
  EXPECT_EQ(found[0], expected[0]);
  EXPECT_EQ(found[1], expected[1]);
}

TEST(PointCloud2, WhatDoesNotFitIsRefused) {
  const auto refused = [](void (*spoil)(Message&)) {
    Message m = cloud_of({4, 12, false, false});
    spoil(m);
    EXPECT_THROW(view_of(m), std::invalid_argument);
  };
  refused([](Message& m) { m.fields.pop_back(); });
  refused([](Message& m) { m.fields[0].datatype = 5; });
  refused([](Message& m) { m.fields[0].count = 3; });
  refused([](Message& m) { m.fields[0].offset = m.point_step - 3; });
  refused([](Message& m) { m.fields[0].offset = 0xfffffffd; });
  refused([](Message& m) { m.data.resize(m.data.size() - 13); });
  refused([](Message& m) { m.row_step = m.width * m.point_step - 1; });
  refused([](Message& m) { m.height = m.width = 0xffffffff, m.row_step = 0xffffffff; });
  refused([](Message& m) { m.width = 0xffffffff, m.height = 1, m.point_step = 0xffffffff; });
  Message nothing = cloud_of({});
  nothing.width = 0;
  nothing.data.clear();
  std::vector<float> scratch;
  EXPECT_EQ(columns_of(view_of(nothing), scratch).size, 0u);
  std::vector<std::uint8_t> ground, obstacles;
  const Label one = Label::kTerrain;
  EXPECT_THROW(split(view_of(nothing), &one, 1, ground, obstacles), std::invalid_argument);
}

}  // namespace
}  // namespace btms
