#include "render/mujoco_owners.h"

#include <mujoco/mujoco.h>

namespace flowscope {

void ModelDeleter::operator()(mjModel_* model) const { mj_deleteModel(model); }
void DataDeleter::operator()(mjData_* data) const { mj_deleteData(data); }

}  // namespace flowscope
