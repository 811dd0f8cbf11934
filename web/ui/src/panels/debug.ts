// Debug: predict, stop at any step of the flow, look, change something, let it run on, carry it out.
import { h } from "../dom";
import { branch_form } from "./branch_form";
import { predict_form } from "./predict_form";
import { step_curves } from "./step_curves";
import { step_numbers } from "./step_numbers";
import { trace_list } from "./trace_list";

export function debug_panel(): HTMLElement {
  return h("div", { class: "panel debug-panel" }, predict_form(), trace_list(), step_numbers(), step_curves(), branch_form());
}
