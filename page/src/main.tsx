import { render } from "preact";
import "./font.css";
import "./look/base.css";
import { App } from "./App";
import { place } from "./route";
import { open } from "./socket";
import * as store from "./store";
import { degrees, World } from "./world/scene";

Object.assign(window, { elib: { ...store, place, degrees, World } }); // for tests, and for those who look under the bonnet
open();
render(<App />, document.body);
