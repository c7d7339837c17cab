import { render } from "preact";
import "./look/base.css";
import { App } from "./App";

render(<App />, document.body);
