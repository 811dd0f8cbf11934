#include "app/trace_overlay.h"

#include <algorithm>
#include <cstdio>

namespace flowscope {

namespace {
Rgba blend(const Rgba& a, const Rgba& b, double t) {
  Rgba c{};
  for (int i = 0; i < 4; ++i) c[i] = static_cast<float>(a[i] + (b[i] - a[i]) * t);
  return c;
}

Rgba faded(Rgba color, float alpha) {
  color[3] = alpha;
  return color;
}

OverlayGhost expert_ghost(const GripperAction& expert) {
  return {expert.world_from_tool, expert.openness, faded(palette::expert, 0.45f)};
}

OverlayLine path_between(const FlowTrace& trace, int from, int to, double width_m, float alpha) {
  OverlayLine line;
  line.width_m = width_m;
  for (int k = from; k <= to; ++k) line.points.push_back(trace.steps[k].pose.position);
  line.color = faded(blend(palette::noise, palette::action, trace.steps[from].t), alpha);
  line.color_end = faded(blend(palette::noise, palette::action, trace.steps[to].t), alpha);
  return line;
}
}  // namespace

Overlay overlay_of(const FlowTrace& trace, int step) {
  Overlay overlay;
  if (trace.steps.empty()) return overlay;
  const int last = static_cast<int>(trace.steps.size()) - 1;
  const int k = std::clamp(step, 0, last);
  const FlowStep& now = trace.steps[k];

  overlay.spheres.push_back({now.region.center, now.region.radius_m, palette::region});
  OverlayPoints inside;
  inside.color = palette::inside;
  for (const auto& p : now.region.inside) inside.points.push_back(p.cast<double>());
  overlay.points.push_back(std::move(inside));

  if (k > 0) overlay.lines.push_back(path_between(trace, 0, k, 0.006, 1.0f));
  if (k < last) overlay.lines.push_back(path_between(trace, k, last, 0.003, 0.45f));
  for (int i = 0; i <= last; ++i) {
    OverlayPoints knot;
    knot.points = {trace.steps[i].pose.position};
    knot.size_m = i == k ? 0.016 : 0.010;
    knot.color = faded(blend(palette::noise, palette::action, trace.steps[i].t), i <= k ? 1.0f : 0.5f);
    overlay.points.push_back(std::move(knot));
  }

  const Rgba ghost = faded(blend(palette::noise, palette::action, now.t), 0.6f);
  overlay.ghosts.push_back({now.pose, now.open_probability, ghost});
  overlay.frames.push_back({now.pose, 0.07, 1});
  if (trace.expert) overlay.ghosts.push_back(expert_ghost(*trace.expert));

  char text[96];
  std::snprintf(text, sizeof text, "t %.2f   r %.3f m   %d points", now.t, now.region.radius_m,
                now.region.points);
  overlay.labels.push_back({now.region.center + Eigen::Vector3d(0, 0, now.region.radius_m + 0.03), text});
  return overlay;
}

Overlay overlay_of_samples(const std::vector<FlowTrace>& samples) {
  Overlay overlay;
  for (const FlowTrace& trace : samples) {
    if (trace.steps.empty()) continue;
    overlay.lines.push_back(path_between(trace, 0, static_cast<int>(trace.steps.size()) - 1, 0.004, 0.9f));
    OverlayPoints end;
    end.points = {trace.result.world_from_tool.position};
    end.size_m = 0.014;
    end.color = palette::action;
    overlay.points.push_back(std::move(end));
    overlay.ghosts.push_back(
        {trace.result.world_from_tool, trace.result.openness, faded(palette::action, 0.35f)});
  }
  if (!samples.empty() && samples.front().expert)
    overlay.ghosts.push_back(expert_ghost(*samples.front().expert));
  return overlay;
}

}  // namespace flowscope
