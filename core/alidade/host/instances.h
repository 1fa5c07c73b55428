// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace alidade {
class ModelInstance;
}

/// All instances of models that there are, for the words about a call that does not return.
namespace alidade::internal {

void AddInstance(const ModelInstance& model);
void DropInstance(const ModelInstance& model);

/// The author's name of the function in that slot of an instance; null: it is none of its.
const char* NameOfCall(const ModelInstance& model, const void* slot);

}  // namespace alidade::internal
