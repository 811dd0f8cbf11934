#include "web/requests.h"

#include <nlohmann/json.hpp>

#include "web/fields.h"

namespace flowscope::web::wire {

namespace {

constexpr int most_flow_steps = 1000, most_samples = 64, most_variations = 1 << 20;
constexpr int most_evaluations = 4000;                  ///< of the network, for all samples of one call
constexpr int smallest_side = 16, largest_side = 4096;  ///< pixels

int whole(Fields& fields, const std::string& key, int low, int high) {
  return static_cast<int>(fields.integer(key, low, high));
}

/// azimuth_deg, elevation_deg, distance (or distance_m), lookat, fovy_deg; true when any was there.
bool read_orbit(Fields& fields, OrbitCamera& orbit) {
  bool any = false;
  const auto number = [&](const std::string& key, double& value) {
    if (!fields.has(key)) return;
    value = fields.number(key);
    any = true;
  };
  number("azimuth_deg", orbit.azimuth_deg);
  number("elevation_deg", orbit.elevation_deg);
  number("distance_m", orbit.distance_m);
  number("distance", orbit.distance_m);
  number("fovy_deg", orbit.fovy_deg);
  if (fields.has("lookat")) {
    orbit.lookat = fields.vector3("lookat");
    any = true;
  }
  if (orbit.distance_m <= 0 || orbit.distance_m > 100) fields.fail("distance", "must lie in (0, 100] metres");
  if (orbit.fovy_deg < 1 || orbit.fovy_deg > 170) fields.fail("fovy_deg", "must lie in [1, 170] degrees");
  return any;
}

void read_size(Fields& fields, ViewSettings& settings) {
  if (const Json* size = fields.find("size"); size && size->is_array()) {
    const auto sides = fields.numbers("size", 2);
    for (const double side : sides)
      if (side != static_cast<int>(side) || side < smallest_side || side > largest_side)
        fields.fail("size", "must hold whole pixels from 16 to 4096");
    settings.width = static_cast<int>(sides[0]);
    settings.height = static_cast<int>(sides[1]);
  } else if (size && !size->is_null()) {
    Fields sides = fields.object("size");
    settings.width = whole(sides, "width", smallest_side, largest_side);
    settings.height = whole(sides, "height", smallest_side, largest_side);
    sides.finish();
  }
  if (fields.has("width")) settings.width = whole(fields, "width", smallest_side, largest_side);
  if (fields.has("height")) settings.height = whole(fields, "height", smallest_side, largest_side);
}

const std::vector<std::string> objectives{"cfm", "ddim", "ddpm"}, radii{"linear", "cosine", "off"};

}  // namespace

ResetRequest reset_request(const Json& body) {
  Fields fields(body);
  ResetRequest request;
  request.task = fields.text("task", 64);
  if (fields.has("variation")) request.variation = whole(fields, "variation", 0, most_variations);
  if (fields.has("seed")) request.seed = fields.seed("seed");
  fields.finish();
  return request;
}

ViewSettings view_request(const Json& body, ViewSettings settings) {
  Fields fields(body);
  if (fields.has("id") && fields.text("id") != settings.id)
    fields.fail("id", "must be the id of the address");
  bool orbit = read_orbit(fields, settings.orbit);
  if (fields.has("orbit")) {
    Fields inner = fields.object("orbit");
    orbit = read_orbit(inner, settings.orbit) || orbit;
    inner.finish();
  }
  const Json* camera = fields.find("camera");
  if (camera && camera->is_object()) {
    Fields inner = fields.object("camera");
    read_orbit(inner, settings.orbit);
    inner.finish();
    settings.camera.reset();
  } else if (camera && !camera->is_null()) {
    settings.camera = fields.text("camera", 64);
  } else if (camera || orbit) {
    settings.camera.reset();
  }
  read_size(fields, settings);
  if (fields.has("overlays")) settings.overlays = fields.boolean("overlays");
  if (fields.has("detectors")) settings.detectors = fields.boolean("detectors");
  fields.finish();
  return settings;
}

CameraDrag drag_request(const Json& body) {
  Fields fields(body);
  CameraDrag drag;
  drag.action = fields.one_of("action", {"rotate", "pan", "zoom"});
  if (fields.has("dx")) drag.dx = fields.number("dx");
  if (fields.has("dy")) drag.dy = fields.number("dy");
  if (std::abs(drag.dx) > 100) fields.fail("dx", "must lie within 100 picture heights");
  if (std::abs(drag.dy) > 100) fields.fail("dy", "must lie within 100 picture heights");
  fields.finish();
  return drag;
}

ScriptRequest script_request(const Json& body) {
  Fields fields(body);
  ScriptRequest request;
  if (fields.has("script")) request.script = fields.text("script", 256 * 1024);
  if (fields.has("task")) request.task = fields.text("task", 64);
  if (fields.has("record")) request.record = fields.boolean("record");
  fields.finish();
  return request;
}

TrainRequest train_request(const Json& body) {
  Fields fields(body);
  TrainRequest request;
  request.start = fields.one_of("action", {"start", "stop"}) == "start";
  if (fields.has("resume")) request.resume = fields.boolean("resume");
  TrainOptions& options = request.options;
  if (fields.has("preset")) options.preset = fields.one_of("preset", {"nano", "desk", "paper"});
  if (fields.has("objective")) options.objective = fields.one_of("objective", objectives);
  if (fields.has("backbone")) options.backbone = fields.one_of("backbone", {"mamba", "transformer"});
  if (fields.has("radius")) options.radius = fields.one_of("radius", radii);
  if (const Json* encoder = fields.find("point_encoder"); encoder && encoder->is_string())
    options.point_encoder = fields.one_of("point_encoder", {"on", "off"}) == "on";
  else if (encoder && !encoder->is_null())
    options.point_encoder = fields.boolean("point_encoder");
  if (fields.has("grounded")) options.grounded = fields.boolean("grounded");
  if (fields.has("augment") && !fields.boolean("augment")) options.augment = Augmentation::none();
  if (fields.has("seed")) options.seed = fields.seed("seed");
  if (fields.has("steps")) request.steps = fields.integer("steps", 1, std::int64_t{1} << 40);
  if (fields.has("minutes")) {
    request.minutes = fields.number("minutes");
    if (*request.minutes <= 0) fields.fail("minutes", "must be above 0");
  }
  if (fields.has("tasks")) request.tasks = fields.texts("tasks");
  if (fields.has("unfinished")) request.unfinished = fields.boolean("unfinished");
  fields.finish();
  return request;
}

PredictRequest predict_request(const Json& body) {
  Fields fields(body);
  PredictRequest request;
  if (fields.has("flow_steps")) request.flow_steps = whole(fields, "flow_steps", 1, most_flow_steps);
  if (fields.has("seed")) request.seed = fields.seed("seed");
  if (fields.has("samples")) request.samples = whole(fields, "samples", 1, most_samples);
  if (fields.has("objective")) request.objective = fields.one_of("objective", objectives);
  if (fields.has("radius")) request.radius = fields.one_of("radius", radii);
  if (fields.has("integrator"))
    request.integrator = fields.one_of("integrator", {"euler", "midpoint", "rk4"});
  const int stages = request.integrator == "rk4" ? 4 : request.integrator == "midpoint" ? 2 : 1;
  if (request.flow_steps * request.samples * stages > most_evaluations) {
    fields.fail(request.samples > 1 ? "samples" : "flow_steps",
                "flow_steps times samples times the integrator's stages (euler 1, midpoint 2, rk4 4) may be "
                "at most " +
                    std::to_string(most_evaluations));
  }
  fields.finish();
  return request;
}

std::optional<int> show_request(const Json& body) {
  Fields fields(body);
  const Json& step = fields.at("step");
  std::optional<int> shown;
  if (!step.is_null()) shown = whole(fields, "step", 0, most_flow_steps);
  fields.finish();
  return shown;
}

BranchRequest branch_request(const Json& body) {
  Fields fields(body);
  BranchRequest request;
  request.step = whole(fields, "step", 0, most_flow_steps);
  if (fields.has("position")) request.position = fields.vector3("position");
  if (fields.has("quaternion")) request.quaternion = fields.quaternion("quaternion").normalized();
  for (const char* key : {"radius", "radius_m"}) {
    if (!fields.has(key)) continue;
    request.radius_m = fields.number(key);
    if (*request.radius_m <= 0) fields.fail(key, "must be above 0 metres");
  }
  if (fields.has("flow_steps")) request.flow_steps = whole(fields, "flow_steps", 1, most_flow_steps);
  fields.finish();
  return request;
}

ExportRequest export_request(const Json& body) {
  Fields fields(body);
  ExportRequest request;
  request.kind = fields.one_of("kind", {"png", "mp4", "strip", "cloud", "gltf", "report"});
  if (fields.has("trace")) request.trace = fields.text("trace", 64);
  if (fields.has("demo")) request.demo = fields.text("demo", 64);
  if (fields.has("step")) request.step = whole(fields, "step", 0, most_flow_steps);
  if (fields.has("camera")) request.camera = fields.text("camera", 64);
  if (fields.has("width")) request.width = whole(fields, "width", smallest_side, largest_side);
  if (fields.has("height")) request.height = whole(fields, "height", smallest_side, largest_side);
  if (fields.has("detectors")) request.detectors = fields.boolean("detectors");
  fields.finish();
  return request;
}

}  // namespace flowscope::web::wire
