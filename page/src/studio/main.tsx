import { render } from "preact";
import "../font.css";
import "../look/base.css";
import * as store from "../store";
import { change } from "./editor";
import { load } from "./known";
import * as programs from "./programs";
import * as run from "./run";
import { Studio } from "./Studio";
import { begin, loading } from "./wire";

Object.assign(window, { elib: { ...store, ...programs, ...run, change, loading } }); // for tests, and for those who look under the bonnet
programs.openLink();
render(<Studio />, document.body);
begin();
load();
