#include <nlohmann/json.hpp>

#include "web/openapi.h"

namespace flowscope::web {

namespace {

constexpr const char* values = R"({
"Vector3":{"type":"array","items":{"type":"number"},"minItems":3,"maxItems":3,"description":"metres, world"},
"Quaternion":{"type":"array","items":{"type":"number"},"minItems":4,"maxItems":4,"description":"w,x,y,z"},
"Vector9":{"type":"array","items":{"type":"number"},"minItems":9,"maxItems":9},
"Pose":{"type":"object","required":["position","quaternion"],"properties":{
  "position":{"$ref":"#/components/schemas/Vector3"},"quaternion":{"$ref":"#/components/schemas/Quaternion"}}},
"Action":{"type":"object","required":["position","quaternion","open"],"properties":{
  "position":{"$ref":"#/components/schemas/Vector3"},"quaternion":{"$ref":"#/components/schemas/Quaternion"},
  "open":{"type":"boolean"},"openness":{"type":"number"}}},
"PoseError":{"type":["object","null"],"required":["position_m","rotation_deg","open_correct"],"properties":{
  "position_m":{"type":"number"},"rotation_deg":{"type":"number"},"open_correct":{"type":"boolean"}}},
"Error":{"type":"object","required":["error"],"properties":{"error":{"type":"object","required":["code","message"],
  "properties":{"code":{"type":"string"},"message":{"type":"string"},"where":{"type":"string"}}}}},
"Health":{"type":"object","required":["status"],"properties":{"status":{"enum":["loading","ready"]},
  "message":{"type":"string"}}},
"Orbit":{"type":"object","properties":{"azimuth_deg":{"type":"number"},"elevation_deg":{"type":"number"},
  "distance":{"type":"number"},"distance_m":{"type":"number"},"lookat":{"$ref":"#/components/schemas/Vector3"},
  "fovy_deg":{"type":"number"}}},
"Started":{"type":"object","required":["job"],"properties":{"job":{"type":"string"}}},
"Predicted":{"type":"object","required":["traces"],"properties":{"traces":{"type":"array","items":{"type":"string"}}}},
"Branched":{"type":"object","required":["trace"],"properties":{"trace":{"type":"string"}}},
"Event":{"type":"object","required":["type","data"],"properties":{
  "type":{"enum":["state","job","train","trace","log"]},"data":{"type":"object"}}}
})";

constexpr const char* scene = R"({
"Task":{"type":"object","required":["name","variations","instructions"],"properties":{"name":{"type":"string"},
  "variations":{"type":"integer"},"instructions":{"type":"array","items":{"type":"string"}}}},
"Tasks":{"type":"object","required":["tasks"],"properties":{
  "tasks":{"type":"array","items":{"$ref":"#/components/schemas/Task"}}}},
"View":{"type":"object","required":["id","camera","orbit","width","height","overlays"],"properties":{
  "id":{"type":"string"},"camera":{"type":["string","null"]},"orbit":{"$ref":"#/components/schemas/Orbit"},
  "width":{"type":"integer"},"height":{"type":"integer"},"overlays":{"type":"boolean"},
  "detectors":{"type":"boolean"}}},
"Term":{"type":"object","required":["name","met","value","path","measured","threshold","unit","wanted","first_met_s"],
  "properties":{"name":{"type":"string"},"met":{"type":"boolean"},"value":{"type":"string"},
  "path":{"type":"string","description":"place in the task's success tree, counted from 0"},
  "measured":{"type":["number","null"]},"threshold":{"type":["number","null"]},"unit":{"type":"string"},
  "wanted":{"enum":["above","at most"]},"first_met_s":{"type":["number","null"]}}},
"State":{"type":"object","required":["task","variation","seed","instruction","views","episode","recording","training",
  "policy"],"properties":{"task":{"type":"string"},"variation":{"type":"integer"},"seed":{"type":"integer"},
  "instruction":{"type":"string"},"views":{"type":"array","items":{"$ref":"#/components/schemas/View"}},
  "cameras":{"type":"array","items":{"type":"string"}},"episode":{"type":"integer"},"time_s":{"type":"number"},
  "success":{"type":"boolean"},"terms":{"type":"array","items":{"$ref":"#/components/schemas/Term"}},
  "recording":{"type":"object","properties":{"running":{"type":"boolean"},"job":{"type":"string"}}},
  "training":{"type":"boolean"},"train":{"type":"object"},"policy":{"type":"object","properties":{
  "loaded":{"type":"boolean"},"file":{"type":"string"},"generation":{"type":"integer"}}},
  "viewers":{"type":"integer"},"rendering_error":{"type":["string","null"]},"shown":{"type":["object","null"]},
  "teleop":{"$ref":"#/components/schemas/Teleop"}}},
"Job":{"type":"object","required":["id","kind","state","progress"],"properties":{"id":{"type":"string"},
  "kind":{"type":"string"},"state":{"enum":["queued","running","done","failed","cancelled"]},
  "progress":{"type":"number"},"message":{"type":"string"},"result":{"type":"object","properties":{
  "demo":{"type":"string"},"url":{"type":"string"},"path":{"type":"string"},"success":{"type":"boolean"}}},
  "error":{"type":"object"}}},
"Jobs":{"type":"object","required":["jobs"],"properties":{
  "jobs":{"type":"array","items":{"$ref":"#/components/schemas/Job"}}}},
"Demo":{"type":"object","required":["id","task","variation","seed","instruction","frames","keyframes","created","bytes"],
  "properties":{"id":{"type":"string"},"task":{"type":"string"},"variation":{"type":"integer"},
  "seed":{"type":"integer"},"instruction":{"type":"string"},"frames":{"type":"integer"},
  "keyframes":{"type":"integer"},"created":{"type":"string"},"bytes":{"type":"integer"},
  "robot":{"type":["string","null"],"description":"null: an older file, which does not say"},
  "scene":{"type":["string","null"],"description":"file of a user's own scene"},
  "success":{"type":["boolean","null"],"description":"false: saved unfinished; null: not known"}}},
"Demos":{"type":"object","required":["demos"],"properties":{
  "demos":{"type":"array","items":{"$ref":"#/components/schemas/Demo"}}}},
"DemoDetail":{"type":"object","required":["id","task","instruction","instructions","keyframes"],"properties":{
  "id":{"type":"string"},"task":{"type":"string"},"variation":{"type":"integer"},"seed":{"type":"integer"},
  "instruction":{"type":"string"},"frames":{"type":"integer"},"created":{"type":"string"},"bytes":{"type":"integer"},
  "robot":{"type":["string","null"]},"scene":{"type":["string","null"]},"success":{"type":["boolean","null"]},
  "scene_origin":{"type":"object","description":"of a user's own scene: file, robot, folder, sha256, robot_sha256, and key where a key frame was named"},
  "instructions":{"type":"array","items":{"type":"string"}},"bounds":{"type":"object"},"seconds":{"type":"number"},
  "cameras":{"type":"array","items":{"type":"string"}},"keyframes":{"type":"array","items":{"type":"object",
  "required":["frame","action"],"properties":{"frame":{"type":"integer"},"time_s":{"type":"number"},
  "action":{"$ref":"#/components/schemas/Action"}}}}}}
})";

constexpr const char* teleop = R"({
"Camera":{"type":"object","required":["name","width","height","fx","fy","cx","cy","world_from_camera"],"properties":{
  "name":{"type":"string"},"width":{"type":"integer"},"height":{"type":"integer"},"fx":{"type":"number"},
  "fy":{"type":"number"},"cx":{"type":"number"},"cy":{"type":"number"},
  "world_from_camera":{"$ref":"#/components/schemas/Pose"}},
  "description":"pixels; camera axes x right, y down, z forward"},
"Step":{"type":"object","required":["kind"],"properties":{"kind":{"enum":["move","gripper"]},
  "frame":{"type":"string"},"position":{"$ref":"#/components/schemas/Vector3"},
  "quaternion":{"$ref":"#/components/schemas/Quaternion"},"path":{"enum":["linear","planned"]},
  "ignore_collisions":{"type":"boolean"},"yaw_symmetry":{"type":"integer"},"openness":{"type":"number"},
  "line":{"type":"integer"},"world":{"$ref":"#/components/schemas/Pose"},"problem":{"type":"string"},
  "base":{"$ref":"#/components/schemas/Pose","description":"world is base times position and quaternion"}}},
"Steps":{"type":"object","required":["steps"],"properties":{
  "steps":{"type":"array","items":{"$ref":"#/components/schemas/Step"}}}},
"Picked":{"type":"object","required":["point","normal","body","geom","depth_m","proposals"],"properties":{
  "point":{"$ref":"#/components/schemas/Vector3"},"normal":{"$ref":"#/components/schemas/Vector3"},
  "body":{"type":"string"},"geom":{"type":"string"},"depth_m":{"type":"number"},
  "proposals":{"type":"array","items":{"type":"object","required":["approach","step","world"],"properties":{
  "approach":{"enum":["above","normal","middle"]},"step":{"$ref":"#/components/schemas/Step"},
  "world":{"$ref":"#/components/schemas/Pose"}}}}}},
"Frames":{"type":"object","required":["frames"],"properties":{"frames":{"type":"array","items":{"type":"object",
  "required":["name","position","quaternion"],"properties":{"name":{"type":"string"},
  "position":{"$ref":"#/components/schemas/Vector3"},"quaternion":{"$ref":"#/components/schemas/Quaternion"}}}}}},
"Teleop":{"type":"object","required":["position","quaternion","openness","jog","message","frames","strokes","marks",
  "by_hand","success"],"properties":{"position":{"$ref":"#/components/schemas/Vector3"},
  "quaternion":{"$ref":"#/components/schemas/Quaternion"},"openness":{"type":"number"},
  "jog":{"enum":["still","moving","blocked","unreachable"]},"message":{"type":"string"},"frames":{"type":"integer"},
  "strokes":{"type":"integer","description":"movements by hand that can be undone"},"marks":{"type":"integer"},
  "by_hand":{"type":"boolean"},"success":{"type":"boolean"}}},
"Saved":{"type":"object","required":["demo"],"properties":{"demo":{"type":"string"}}}
})";

constexpr const char* policy = R"({
"Train":{"type":"object","required":["running","step","loss","loss_history","samples_per_s"],"properties":{
  "running":{"type":"boolean"},"step":{"type":"integer"},"loss":{"type":"number"},"loss_flow":{"type":"number"},
  "loss_position":{"type":"number"},"loss_rotation":{"type":"number"},"loss_open":{"type":"number"},
  "skipped":{"type":"integer"},"samples_per_s":{"type":"number"},"minutes":{"type":"number"},
  "demos":{"type":"integer"},"validation":{"type":"object","description":"null where nothing is held out",
  "properties":{"position_mm":{"type":["number","null"]},"rotation_deg":{"type":["number","null"]},
  "keyframes":{"type":"integer"},"tasks":{"type":"array"}}},
  "loss_history":{"type":"array","description":"[step, loss]"},
  "validation_history":{"type":"array","description":"[step, mm, degrees]"},"error":{"type":["string","null"]},
  "left_out":{"type":"array","description":"damaged demonstrations","items":{"type":"object",
    "properties":{"id":{"type":"string"},"problem":{"type":"string"}}}}}},
"TraceEntry":{"type":"object","required":["id","created","task","instruction","flow_steps","error","parent"],
  "properties":{"id":{"type":"string"},"created":{"type":"string"},"task":{"type":"string"},
  "instruction":{"type":"string"},"flow_steps":{"type":"integer"},"error":{"$ref":"#/components/schemas/PoseError"},
  "parent":{"type":["string","null"]}}},
"Traces":{"type":"object","required":["traces"],"properties":{
  "traces":{"type":"array","items":{"$ref":"#/components/schemas/TraceEntry"}}}},
"FlowStep":{"type":"object","required":["k","t","x","velocity","pose","region","open_probability","ms"],"properties":{
  "k":{"type":"integer"},"t":{"type":"number"},"x":{"$ref":"#/components/schemas/Vector9"},
  "velocity":{"$ref":"#/components/schemas/Vector9"},"pose":{"$ref":"#/components/schemas/Pose"},
  "region":{"type":"object","required":["center","radius","points"],"properties":{
  "center":{"$ref":"#/components/schemas/Vector3"},"radius":{"type":"number"},"points":{"type":"integer"}}},
  "open_probability":{"type":"number"},"ms":{"type":"number"},"weights":{"type":"array","items":{"type":"object"}}}},
"Trace":{"type":"object","required":["format","id","created","policy","radius","flow_steps","seed","integrator","scene",
  "instruction","steps","result","expert","error","parent"],"properties":{"format":{"const":"flowscope-trace/1"},
  "id":{"type":"string"},"created":{"type":"string"},"policy":{"type":"object"},"radius":{"type":"object"},
  "flow_steps":{"type":"integer"},"seed":{"type":"integer"},"integrator":{"enum":["euler","midpoint","rk4"]},
  "scene":{"type":"object"},"instruction":{"type":"string"},
  "steps":{"type":"array","items":{"$ref":"#/components/schemas/FlowStep"}},
  "result":{"$ref":"#/components/schemas/Action"},"expert":{"type":["object","null"]},
  "error":{"$ref":"#/components/schemas/PoseError"},"parent":{"type":["object","null"]}}}
})";

}  // namespace

wire::Json openapi_schemas() {
  wire::Json all = wire::Json::parse(values);
  all.update(wire::Json::parse(scene));
  all.update(wire::Json::parse(teleop));
  all.update(wire::Json::parse(policy));
  return all;
}

}  // namespace flowscope::web
