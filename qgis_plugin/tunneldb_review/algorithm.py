"""A command of ``tunneldb`` as an algorithm of Processing, made of its description in :mod:`.commands`."""

from __future__ import annotations

import os
from typing import Any, Dict, Optional

from qgis.core import (
    QgsProcessing,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingOutputNumber,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterFile,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterFolderDestination,
    QgsProcessingParameterMultipleLayers,
    QgsProcessingParameterNumber,
    QgsProcessingParameterString,
    QgsProject,
    QgsVectorLayer,
)

from .commands import Command, Parameter, arguments_of, error_of, help_of, progress_of
from .runner import CommandError, run
from .settings import Settings

EXIT_CODE, LOAD = "EXIT_CODE", "LOAD"


class CommandAlgorithm(QgsProcessingAlgorithm):
    """Calls a command of the command line.

    Parameters
    ----------
    command : Command
    """

    def __init__(self, command: Command) -> None:
        super().__init__()
        self.command = command
        self._written = ""

    def createInstance(self) -> CommandAlgorithm:
        """Return another of the same."""
        return CommandAlgorithm(self.command)

    def name(self) -> str:
        """Return its id."""
        return self.command.name

    def displayName(self) -> str:
        """Return its name."""
        return self.command.title

    def group(self) -> str:
        """Return the group's name."""
        return self.command.group

    def groupId(self) -> str:
        """Return the group's id."""
        return self.command.group.lower().replace(" ", "_")

    def shortHelpString(self) -> str:
        """Return its help."""
        return help_of(self.command)

    def initAlgorithm(self, configuration: Optional[Dict[str, Any]] = None) -> None:
        """Make the parameters."""
        for parameter in self.command.parameters:
            made = _parameter(parameter)
            made.setHelp(parameter.help)
            if parameter.advanced:
                made.setFlags(made.flags() | QgsProcessingParameterDefinition.FlagAdvanced)
            self.addParameter(made)
        if self.command.loads:
            self.addParameter(QgsProcessingParameterBoolean(LOAD, "Add the output to the project", defaultValue=True))
        self.addOutput(QgsProcessingOutputNumber(EXIT_CODE, "Exit code"))

    def processAlgorithm(self, parameters: Dict[str, Any], context: QgsProcessingContext, feedback: Any) -> Dict[str, Any]:
        """Run the command."""
        settings = Settings.read()
        values = {item.name: self._value(item, parameters, context) for item in self.command.parameters}
        try:
            arguments = arguments_of(self.command, values)
            connection = settings.connection() if self.command.database else None
        except (CommandError, ValueError) as error:
            raise QgsProcessingException(str(error)) from None
        before = connection.arguments() if connection is not None else []
        environment = connection.environment() if connection is not None else {}
        feedback.pushCommandInfo(" ".join(map(_shown, [settings.program, *before, *arguments])))

        def tell(line: str, wrong: bool) -> None:
            share = progress_of(line)
            if share is not None:
                feedback.setProgress(100.0 * share)
            if line.strip():
                feedback.pushInfo(line)

        try:
            ended = run(settings.program, [*before, *arguments], environment, tell, feedback.isCanceled)
        except CommandError as error:
            raise QgsProcessingException(str(error)) from None
        if ended.cancelled:
            feedback.pushInfo("Cancelled: completed stages are in the database, and the next run continues from there.")
            return {EXIT_CODE: ended.code}
        if ended.code not in (0, 1):
            raise QgsProcessingException(error_of(ended.error) or f"{settings.program} ended with exit code {ended.code}")
        if ended.code == 1:
            feedback.reportError(
                f"Exit code 1: {self.command.wrong or error_of(ended.error) or 'something is wrong, see above'}"
            )
        written = {item.name: values[item.name] for item in self.command.parameters if item.kind in ("output", "folder")}
        self._load(parameters, context, [str(path) for path in written.values() if path])
        return {**written, EXIT_CODE: ended.code}

    def _value(self, item: Parameter, parameters: Dict[str, Any], context: QgsProcessingContext) -> Any:
        given = parameters.get(item.name)
        if item.kind == "flag":
            return self.parameterAsBool(parameters, item.name, context)
        if given is None or given == "":
            return None
        if item.kind == "choice":
            return item.choices[self.parameterAsEnum(parameters, item.name, context)]
        if item.kind == "choices":
            return [item.choices[n] for n in self.parameterAsEnums(parameters, item.name, context)]
        if item.kind == "integer":
            return self.parameterAsInt(parameters, item.name, context)
        if item.kind == "number":
            return self.parameterAsDouble(parameters, item.name, context)
        if item.kind == "files":
            return self.parameterAsFileList(parameters, item.name, context)
        if item.kind in ("output", "folder"):
            return self.parameterAsFileOutput(parameters, item.name, context)
        return self.parameterAsString(parameters, item.name, context)

    def _load(self, parameters: Dict[str, Any], context: QgsProcessingContext, paths: list[str]) -> None:
        """Add the output to the project, if it consists of layers and the user wants it."""
        if not self.command.loads or not self.parameterAsBool(parameters, LOAD, context):
            return
        for path in paths:
            if not path.lower().endswith((".gpkg", ".geojson", ".dxf")) or not os.path.exists(path):  # noqa: PTH110
                continue
            layer = QgsVectorLayer(path, "", "ogr")
            names = [part.split(layer.dataProvider().sublayerSeparator())[1] for part in layer.dataProvider().subLayers()]
            for name in names or [""]:
                source = f"{path}|layername={name}" if name and len(names) > 1 else path
                title = name or os.path.basename(path)  # noqa: PTH119
                details = QgsProcessingContext.LayerDetails(title, context.project() or QgsProject.instance(), title)
                context.addLayerToLoadOnCompletion(source, details)


def _parameter(item: Parameter) -> QgsProcessingParameterDefinition:
    """Return a parameter of Processing as it is described."""
    optional = not item.required
    if item.kind == "flag":
        return QgsProcessingParameterBoolean(item.name, item.title, defaultValue=bool(item.default))
    if item.kind in ("choice", "choices"):
        default = item.choices.index(str(item.default)) if item.default is not None else None
        return QgsProcessingParameterEnum(
            item.name, item.title, list(item.choices), item.kind == "choices", default, optional=optional
        )
    if item.kind in ("integer", "number"):
        whole = item.kind == "integer"
        kind = QgsProcessingParameterNumber.Integer if whole else QgsProcessingParameterNumber.Double
        made = QgsProcessingParameterNumber(item.name, item.title, kind, item.default, optional)
        if item.minimum is not None:
            made.setMinimum(item.minimum)
        if item.maximum is not None:
            made.setMaximum(item.maximum)
        return made
    if item.kind == "file":
        return QgsProcessingParameterFile(item.name, item.title, optional=optional, fileFilter=item.filter or "All files (*)")
    if item.kind == "files":
        return QgsProcessingParameterMultipleLayers(item.name, item.title, QgsProcessing.TypeFile, optional=optional)
    if item.kind == "output":
        return QgsProcessingParameterFileDestination(
            item.name, item.title, item.filter, optional=optional, createByDefault=not optional
        )
    if item.kind == "folder":
        return QgsProcessingParameterFolderDestination(item.name, item.title, optional=optional, createByDefault=not optional)
    default = Settings.read().survey if item.kind == "survey" else item.default
    return QgsProcessingParameterString(item.name, item.title, default or None, optional=optional)


def _shown(word: str) -> str:
    return (
        word
        if word and all(letter.isalnum() or letter in "-_./=:,+@%" for letter in word)
        else "'" + word.replace("'", "'\\''") + "'"
    )
