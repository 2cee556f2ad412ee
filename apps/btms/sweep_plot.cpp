#include "apps/btms/sweep_plot.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "io/files/atomic_file.h"

namespace btms {
namespace {

constexpr double kPanelWidth = 300, kPanelHeight = 230, kLeft = 62, kTop = 44, kBetween = 34, kBottom = 84, kRight = 20,
                 kLegendColumn = 350;

struct Line {
  const char* title;
  Completion completion;
  Confusion Scores::*part;
  const char* colour;
  const char* dashes;  // SVG's stroke-dasharray
};
constexpr Line kLines[] = {
    {"with completion", Completion::kKernel, &Scores::without, "#1b6ca8", "none"},
    {"no completion", Completion::kNone, &Scores::without, "#d1495b", "none"},
    {"with completion, ambiguous classes counted", Completion::kKernel, &Scores::with, "#1b6ca8", "5 4"},
    {"no completion, ambiguous classes counted", Completion::kNone, &Scores::with, "#d1495b", "5 4"},
};

std::span<const Line> lines_of(const Sweep& sweep) {
  const std::span<const Line> all(kLines);
  return sweep.ambiguous ? all : all.first(2);
}

// Percent at the top and the bottom of the panels, and between the grid's lines.
struct Axis {
  double low = 0, high = 100, step = 10;
  double y(double percent) const { return kTop + kPanelHeight * (high - percent) / (high - low); }
};

Axis axis_of(const Sweep& sweep) {
  double low = 100, high = 0;
  for (const SweepRow& row : sweep.rows)
    for (const Line& line : lines_of(sweep)) {
      low = std::min(low, 100 * row.accuracy(line.part));
      high = std::max(high, 100 * row.accuracy(line.part));
    }
  Axis axis;
  for (const double step : {20.0, 10.0, 5.0, 2.0, 1.0, 0.5})
    if (high - low <= 6 * step) axis.step = step;
  axis.low = std::max(0.0, std::floor(low / axis.step - 0.2) * axis.step);
  axis.high = std::min(100.0, std::ceil(high / axis.step + 0.2) * axis.step);
  return axis;
}

std::string text(double x, double y, std::string_view anchor, std::string_view content, std::string_view style = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, style, content);
}

std::string rule(double x0, double y0, double x1, double y1, std::string_view colour) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n", x0, y0, x1, y1,
                     colour);
}

std::string axis_title(const std::string& parameter) {
  for (const ParameterInfo& info : parameter_table())
    if (info.name == parameter) {
      std::string title = parameter.ends_with(fmt::format("_{}", info.unit))
                              ? parameter.substr(0, parameter.size() - info.unit.size() - 1)
                              : parameter;
      std::replace(title.begin(), title.end(), '_', ' ');
      if (!info.symbol.empty()) title += fmt::format(" ({})", info.symbol);
      return info.unit.empty() ? title : fmt::format("{}, {}", title, info.unit);
    }
  return parameter;
}

std::string panel(const Sweep& sweep, const std::string& parameter, double left, const Axis& axis) {
  std::vector<double> values;
  for (const SweepRow& row : sweep.rows)
    if (row.parameter == parameter) values.push_back(row.value);
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  const double least = values.front(), reach = std::max(values.back() - least, 1e-9);
  const auto x = [&](double value) { return left + 14 + (kPanelWidth - 28) * (value - least) / reach; };

  std::string svg;
  for (double percent = axis.low; percent <= axis.high + 1e-9; percent += axis.step)
    svg += rule(left, axis.y(percent), left + kPanelWidth, axis.y(percent), "#e3e6ea");
  svg += rule(left, kTop + kPanelHeight, left + kPanelWidth, kTop + kPanelHeight, "#8a9099");
  double labelled = -1e9;
  for (const double value : values) {
    svg += rule(x(value), kTop + kPanelHeight, x(value), kTop + kPanelHeight + 4, "#8a9099");
    if (x(value) - labelled < 26) continue;
    labelled = x(value);
    svg += text(x(value), kTop + kPanelHeight + 18, "middle", fmt::format("{}", value));
  }
  svg += text(left + kPanelWidth / 2, kTop + kPanelHeight + 38, "middle", axis_title(parameter));
  for (const Line& line : lines_of(sweep)) {
    std::vector<std::pair<double, double>> points;
    for (const SweepRow& row : sweep.rows)
      if (row.parameter == parameter && row.completion == line.completion)
        points.emplace_back(row.value, 100 * row.accuracy(line.part));
    std::sort(points.begin(), points.end());
    std::string path, dots;
    for (const auto& [value, percent] : points) {
      path += fmt::format("{:.1f},{:.1f} ", x(value), axis.y(percent));
      dots += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", x(value), axis.y(percent),
                          line.colour);
    }
    svg += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\" stroke-dasharray=\"{}\"/>\n{}", path,
        line.colour, line.dashes, dots);
  }
  return svg;
}

std::string legend(const Sweep& sweep, double y) {
  std::string svg;
  double x = kLeft;
  int i = 0;
  for (const Line& line : lines_of(sweep)) {
    if (i++ == 2) x = kLeft, y += 20;
    svg += fmt::format(
        "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"2\" "
        "stroke-dasharray=\"{}\"/>\n",
        x, y - 4, x + 28, y - 4, line.colour, line.dashes);
    svg += text(x + 36, y, "start", line.title);
    x += kLegendColumn;
  }
  return svg;
}

}  // namespace

void write_sweep_plot(const Sweep& sweep, const std::filesystem::path& path) {
  const Axis axis = axis_of(sweep);
  const std::vector<std::string> parameters = sweep.parameters();
  const auto panels = static_cast<double>(parameters.size());
  const double width =
      std::max(kLeft + kRight + panels * kPanelWidth + (panels - 1) * kBetween, kLeft + kRight + 2 * kLegendColumn);
  const double height = kTop + kPanelHeight + kBottom + (sweep.ambiguous ? 20 : 0);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "font-family=\"system-ui, sans-serif\" font-size=\"13\" fill=\"#2b3038\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
      width, height);
  svg += text(
      kLeft, 24, "start",
      fmt::format("Accuracy in percent, {}, {} {}", sweep.preset, sweep.files, sweep.files == 1 ? "file" : "files"),
      " font-weight=\"600\" font-size=\"15\"");
  for (double percent = axis.low; percent <= axis.high + 1e-9; percent += axis.step)
    svg += text(kLeft - 8, axis.y(percent) + 4, "end", fmt::format("{}", percent));
  double left = kLeft;
  for (const std::string& name : parameters) {
    svg += panel(sweep, name, left, axis);
    left += kPanelWidth + kBetween;
  }
  svg += legend(sweep, kTop + kPanelHeight + 66) + "</svg>\n";
  write_file(path, svg);
}

}  // namespace btms
