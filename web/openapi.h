// The OpenAPI document, made from the route table so that it cannot lag behind.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "web/router.h"

namespace flowscope::web {

wire::Json openapi(const std::vector<Route>& routes, const std::string& cookie = "flowscope_token");
/// The named schemas that answers refer to.
wire::Json openapi_schemas();

}  // namespace flowscope::web
